#include "scene/object.h"

#include <algorithm>
#include <cmath>

namespace warpath {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::string describe(const Object& object) { return fmt::format("{} \"{}\"", object.tag, object.type); }

}  // namespace

std::string describe_type(const PropertyValue& value) {
  struct Visitor {
    std::string operator()(bool) const { return "a <boolean>"; }
    std::string operator()(std::int64_t) const { return "an <integer>"; }
    std::string operator()(double) const { return "a <float>"; }
    std::string operator()(const std::string&) const { return "a <string>"; }
    std::string operator()(const Imath::V3d&) const { return "a <vector>"; }
    std::string operator()(const RgbValue&) const { return "an <rgb>"; }
    std::string operator()(const SpectrumValue&) const { return "a <spectrum>"; }
    std::string operator()(const Transform&) const { return "a <transform>"; }
    std::string operator()(const Object* object) const { return "a <" + object->tag + ">"; }
  };
  return std::visit(Visitor{}, value);
}

const Property* Object::find(std::string_view name) const {
  m_asked.emplace_back(name);
  for (const Property& property : properties)
    if (property.name == name) return &property;
  return nullptr;
}

const Property* Object::take(std::string_view name) const {
  const Property* property = find(name);
  if (property) property->read = true;
  return property;
}

template <class T>
const T* Object::get(std::string_view name, std::string_view wanted) const {
  const Property* property = take(name);
  if (!property) return nullptr;
  const T* value = std::get_if<T>(&property->value);
  if (!value)
    fail(property->where, "\"{}\" of {} must be {}, not {}", name, describe(*this), wanted,
         describe_type(property->value));
  return value;
}

float Object::get_float(std::string_view name, float missing) const {
  const Property* property = take(name);
  if (!property) return missing;
  if (const auto* integer = std::get_if<std::int64_t>(&property->value)) return static_cast<float>(*integer);
  const double value = *get<double>(name, "a <float>");
  if (!std::isfinite(value)) fail(property->where, "\"{}\" of {} must be finite, not {}", name, describe(*this), value);
  return static_cast<float>(value);
}

float Object::require_float(std::string_view name) const {
  if (!has(name)) fail(where, "{} needs a <float name=\"{}\">", describe(*this), name);
  return get_float(name, 0);
}

std::int64_t Object::get_integer(std::string_view name, std::int64_t missing, std::int64_t least,
                                 std::int64_t most) const {
  const auto* value = get<std::int64_t>(name, "an <integer>");
  if (!value) return missing;
  if (*value < least || *value > most)
    fail(find(name)->where, "\"{}\" of {} must be from {} to {}, not {}", name, describe(*this), least, most, *value);
  return *value;
}

bool Object::get_boolean(std::string_view name, bool missing) const {
  const bool* value = get<bool>(name, "a <boolean>");
  return value ? *value : missing;
}

std::string Object::get_string(std::string_view name, std::string_view missing) const {
  const std::string* value = get<std::string>(name, "a <string>");
  return value ? *value : std::string(missing);
}

std::string Object::require_string(std::string_view name) const {
  if (!has(name)) fail(where, "{} needs a <string name=\"{}\">", describe(*this), name);
  return get_string(name, "");
}

Imath::V3d Object::get_vector(std::string_view name, const Imath::V3d& missing) const {
  const auto* value = get<Imath::V3d>(name, "a <point>");
  return value ? *value : missing;
}

Transform Object::get_transform(std::string_view name) const {
  const auto* value = get<Transform>(name, "a <transform>");
  return value ? *value : Transform{Keyframe{}};
}

std::string Object::get_choice(std::string_view name, std::string_view missing,
                               std::initializer_list<std::string_view> known) const {
  const std::string value = lower(get_string(name, missing));
  if (std::find(known.begin(), known.end(), value) == known.end())
    fail(find(name)->where, "unknown {} \"{}\";{}", name, value, suggestion(value, {known.begin(), known.size()}));
  return value;
}

std::vector<const Property*> Object::take_objects(std::string_view wanted) const {
  std::vector<const Property*> result;
  for (const Property& property : properties) {
    const auto* object = std::get_if<const Object*>(&property.value);
    if (!object || (*object)->tag != wanted) continue;
    property.read = true;
    result.push_back(&property);
  }
  return result;
}

void Object::ignore(std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names) take(name);
}

void Object::check_all_read() const {
  for (const Property& property : properties) {
    if (property.read) continue;
    if (const auto* object = std::get_if<const Object*>(&property.value)) {
      if (property.name.empty()) fail(property.where, "{} cannot stand in {}", describe(**object), describe(*this));
    }
    std::vector<std::string_view> known(m_asked.begin(), m_asked.end());
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    fail(property.where, "{} has no property \"{}\";{}", describe(*this), property.name,
         known.empty() ? " it has none" : suggestion(property.name, known));
  }
}

}  // namespace warpath
