#pragma once
#include <Imath/ImathVec.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/math.h"
#include "scene/transform.h"
#include "scene/xml.h"

namespace warpath {

class Object;

/// <rgb>: linear.
struct RgbValue {
  Color color;
};
/// <spectrum value="...">: one value, or values at increasing wavelengths (nm).
struct SpectrumValue {
  std::vector<double> wavelengths, values;
};
using PropertyValue = std::variant<bool, std::int64_t, double, std::string, Imath::V3d, RgbValue, SpectrumValue,
                                   Transform, const Object*>;

struct Property {
  std::string name;  ///< empty for a nested object without a name
  PropertyValue value;
  Location where;
  mutable bool read = false;
};

/// A plugin as a scene file asks for it (<bsdf type="diffuse">) with its properties. Who builds it reads them by name
/// and type; what nobody has read in the end is an error, with the nearest of the names that were asked for.
class Object {
 public:
  std::string tag, type, id;
  Location where;
  std::vector<Property> properties;

  const Property* find(std::string_view name) const;  ///< null if absent; does not mark it as read
  bool has(std::string_view name) const { return find(name) != nullptr; }

  // Typed values: the default if absent, SceneError if of another type (an integer is a float, too) or not finite.
  float get_float(std::string_view name, float missing) const;
  float require_float(std::string_view name) const;
  std::int64_t get_integer(std::string_view name, std::int64_t missing, std::int64_t least, std::int64_t most) const;
  bool get_boolean(std::string_view name, bool missing) const;
  std::string get_string(std::string_view name, std::string_view missing) const;
  std::string require_string(std::string_view name) const;
  Imath::V3d get_vector(std::string_view name, const Imath::V3d& missing) const;
  Transform get_transform(std::string_view name) const;  ///< identity if absent
  /// One of the known words, in lower case; SceneError with a suggestion for any other.
  std::string get_choice(std::string_view name, std::string_view missing,
                         std::initializer_list<std::string_view> known) const;

  /// Marks a property as read and gives it; null if absent.
  const Property* take(std::string_view name) const;
  /// Nested objects with this tag, in the order of the file, marked as read; named or not.
  std::vector<const Property*> take_objects(std::string_view tag) const;
  /// For properties that cannot change the image.
  void ignore(std::initializer_list<std::string_view> names) const;
  /// SceneError for the first property that was not read.
  void check_all_read() const;

 private:
  template <class T>
  const T* get(std::string_view name, std::string_view wanted) const;
  mutable std::vector<std::string> m_asked;  // names that somebody looked for: what a suggestion may suggest
};

/// All objects of a scene, with references resolved.
struct ObjectTree {
  std::vector<std::unique_ptr<Object>> objects;  ///< objects[0] is the scene
  const Object& scene() const { return *objects.front(); }
};

/// Throws SceneError: unknown elements, values that cannot be read, unknown or doubly used ids, circular references.
ObjectTree build_objects(const XmlElement& root);

/// `<rgb>` as people would write it, for messages: "an <rgb>".
std::string describe_type(const PropertyValue& value);

}  // namespace warpath
