#include <algorithm>
#include <cctype>
#include <charconv>
#include <unordered_map>

#include "scene/object.h"
#include "scene/srgb.h"

namespace warpath {
namespace {

constexpr std::string_view kObjectTags[] = {"scene",   "shape",      "bsdf",    "texture", "emitter", "sensor", "film",
                                            "rfilter", "integrator", "sampler", "medium",  "phase",   "volume"};
constexpr std::string_view kKnownTags[] = {
    "scene",  "shape",  "bsdf",      "texture",   "emitter", "sensor",  "film",    "rfilter", "integrator", "sampler",
    "medium", "phase",  "volume",    "float",     "integer", "string",  "boolean", "rgb",     "srgb",       "spectrum",
    "point",  "vector", "transform", "animation", "ref",     "include", "alias",   "default", "path"};

bool is_object(const XmlElement& element) {
  return std::find(std::begin(kObjectTags), std::end(kObjectTags), element.tag) != std::end(kObjectTags) ||
         (element.tag == "spectrum" && element.attribute("type"));
}

/// Names of Mitsuba 0.x files: toWorld is to_world, intIOR is int_ior.
std::string underscore_case(std::string_view name) {
  std::string result;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    if (i > 0 && std::isupper(c) && std::islower(static_cast<unsigned char>(name[i - 1]))) {
      result += '_';
      for (; i < name.size() && std::isupper(static_cast<unsigned char>(name[i])); ++i)
        result += static_cast<char>(std::tolower(static_cast<unsigned char>(name[i])));
      --i;
    } else {
      result += name[i];
    }
  }
  return result;
}

class Builder {
 public:
  ObjectTree build(const XmlElement& root) {
    add(root);
    resolve();
    check_cycles();
    for (const auto& object : m_tree.objects)
      if (object->where.file->major_version < 2) upgrade(*object);
    return std::move(m_tree);
  }

 private:
  struct PendingReference {
    std::size_t object, property;
    std::string id;
  };
  struct Alias {
    std::string id, as;
    Location where;
  };

  std::size_t add(const XmlElement& element);
  void add_property(std::size_t object, const XmlElement& element);
  void add_child(std::size_t object, const XmlElement& element);
  void upgrade(Object& object);
  void resolve();
  void check_cycles();

  ObjectTree m_tree;
  std::unordered_map<std::string, std::size_t> m_ids;
  std::vector<PendingReference> m_references;
  std::vector<Alias> m_aliases;
};

bool parse_boolean(const XmlElement& element) {
  std::string text = element.required_attribute("value");
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  if (text != "true" && text != "false") fail(element.where, "\"{}\" is neither true nor false", text);
  return text == "true";
}

std::int64_t parse_integer(const XmlElement& element) {
  std::string_view text = element.required_attribute("value");
  const std::size_t begin = text.find_first_not_of(" \t\r\n"), end = text.find_last_not_of(" \t\r\n");
  std::string_view word = begin == std::string_view::npos ? "" : text.substr(begin, end - begin + 1);
  if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || stop != word.data() + word.size()) fail(element.where, "\"{}\" is not an integer", text);
  return value;
}

Imath::V3d parse_vector(const XmlElement& element) {
  element.check_attributes({"name", "value", "x", "y", "z"});
  std::vector<double> v;
  if (const std::string* value = element.attribute("value")) {
    v = parse_numbers(*value, element.where);
    if (v.size() == 1) v = {v[0], v[0], v[0]};
  } else {
    for (const char* name : {"x", "y", "z"}) v.push_back(parse_number(element.required_attribute(name), element.where));
  }
  if (v.size() != 3) fail(element.where, "<{}> needs three numbers, not {}", element.tag, v.size());
  return Imath::V3d(v[0], v[1], v[2]);
}

/// "r, g, b", one number for all three, or #rrggbb. <rgb> is linear, <srgb> (Mitsuba 0.x) carries the sRGB curve.
RgbValue parse_rgb(const XmlElement& element) {
  const std::string& text = element.required_attribute("value");
  std::vector<double> v;
  if (!text.empty() && text[0] == '#') {
    unsigned bits = 0;
    const auto [stop, error] = std::from_chars(text.data() + 1, text.data() + text.size(), bits, 16);
    if (text.size() != 7 || error != std::errc() || stop != text.data() + text.size())
      fail(element.where, "\"{}\" is no colour like #f9aa34", text);
    for (const int shift : {16, 8, 0}) v.push_back((bits >> shift & 255) / 255.0);
  } else {
    v = parse_numbers(text, element.where);
    if (v.size() == 1) v = {v[0], v[0], v[0]};
  }
  if (v.size() != 3) fail(element.where, "<{}> needs one or three numbers, not {}", element.tag, v.size());
  Color color(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(color[i])) fail(element.where, "<{}> has a number that is not finite", element.tag);
    if (element.tag == "srgb") color[i] = srgb_to_linear(color[i]);
  }
  return {color};
}

SpectrumValue parse_spectrum(const XmlElement& element) {
  element.check_attributes({"name", "value"});
  SpectrumValue result;
  std::string text = element.required_attribute("value");
  if (text.find(':') == std::string::npos) {
    result.values = {parse_number(text, element.where)};
    return result;
  }
  std::replace(text.begin(), text.end(), ':', ' ');
  const auto v = parse_numbers(text, element.where);
  if (v.size() % 2 != 0 || v.size() < 4) fail(element.where, "<spectrum> needs two or more wavelength:value pairs");
  for (std::size_t i = 0; i < v.size(); i += 2) {
    if (i > 0 && v[i] <= v[i - 2]) fail(element.where, "the wavelengths of <spectrum> must increase");
    result.wavelengths.push_back(v[i]);
    result.values.push_back(v[i + 1]);
  }
  return result;
}

std::size_t Builder::add(const XmlElement& element) {
  const std::size_t index = m_tree.objects.size();
  m_tree.objects.push_back(std::make_unique<Object>());
  Object& object = *m_tree.objects.back();
  object.tag = element.tag == "spectrum" ? "texture" : element.tag;
  object.where = element.where;
  if (index == 0) {
    element.check_attributes({"version", "type", "id", "name"});
    object.type = "scene";
  } else {
    element.check_attributes({"type", "id", "name"});
    object.type = element.required_attribute("type");
  }
  if (const std::string* id = element.attribute("id"); id && !id->empty()) {
    object.id = *id;
    const auto [previous, inserted] = m_ids.emplace(*id, index);
    if (!inserted)
      fail(element.where, "the id \"{}\" is taken: {}", *id, to_string(m_tree.objects[previous->second]->where));
  }
  for (const XmlElement& child : element.children) add_child(index, child);
  return index;
}

void Builder::add_child(std::size_t object, const XmlElement& element) {
  if (element.tag == "alias") {
    element.check_attributes({"id", "as"});
    m_aliases.push_back({element.required_attribute("id"), element.required_attribute("as"), element.where});
    return;
  }
  if (is_object(element)) {
    const std::string* name = element.attribute("name");
    const std::size_t child = add(element);
    m_tree.objects[object]->properties.push_back(
        {name ? *name : std::string(), static_cast<const Object*>(m_tree.objects[child].get()), element.where});
    return;
  }
  add_property(object, element);
}

void Builder::add_property(std::size_t object_index, const XmlElement& element) {
  Object& object = *m_tree.objects[object_index];
  const Location& where = element.where;
  const std::string& tag = element.tag;
  if (tag == "ref") {
    element.check_attributes({"id", "name"});
    const std::string* name = element.attribute("name");
    m_references.push_back({object_index, object.properties.size(), element.required_attribute("id")});
    object.properties.push_back({name ? *name : std::string(), static_cast<const Object*>(nullptr), where});
    return;
  }
  if (std::find(std::begin(kKnownTags), std::end(kKnownTags), tag) == std::end(kKnownTags)) {
    for (const char* operation : {"translate", "rotate", "scale", "lookat", "lookAt", "matrix"})
      if (tag == operation) fail(where, "<{}> can only stand in a <transform>", tag);
    fail(where, "unknown element <{}>;{}", tag, suggestion(tag, kKnownTags));
  }
  const std::string& name = element.required_attribute("name");
  if (name.empty()) fail(where, "<{}> needs a name", tag);
  for (const Property& other : object.properties)
    if (other.name == name) fail(where, "\"{}\" is given twice, before that at {}", name, to_string(other.where));

  if (tag == "transform" || tag == "animation") {
    Transform transform = tag == "transform" ? parse_transform(element) : parse_animation(element);
    object.properties.push_back({name, std::move(transform), where});
    return;
  }
  if (!element.children.empty())
    fail(element.children[0].where, "<{}> cannot stand in <{}>", element.children[0].tag, tag);

  PropertyValue value;
  if (tag == "point" || tag == "vector") {
    value = parse_vector(element);
  } else if (tag == "spectrum") {
    if (element.attribute("filename"))
      fail(where, "spectra in files are not supported yet; write the wavelength:value pairs or an <rgb>");
    value = parse_spectrum(element);
  } else {
    element.check_attributes({"name", "value"});
    if (tag == "float") value = parse_number(element.required_attribute("value"), where);
    if (tag == "integer") value = parse_integer(element);
    if (tag == "boolean") value = parse_boolean(element);
    if (tag == "string") value = element.required_attribute("value");
    if (tag == "rgb" || tag == "srgb") value = parse_rgb(element);
  }
  object.properties.push_back({name, std::move(value), where});
}

/// What Mitsuba 3 does with files of version 0.x and 1.x.
void Builder::upgrade(Object& object) {
  for (Property& property : object.properties) property.name = underscore_case(property.name);
  if (object.type == "diffuse")
    for (Property& property : object.properties)
      if (property.name == "diffuse_reflectance") property.name = "reflectance";

  Imath::V3d offset(0), scale(1);
  Location where;
  std::erase_if(object.properties, [&](const Property& property) {
    double* target = property.name == "uoffset"   ? &offset.x
                     : property.name == "voffset" ? &offset.y
                     : property.name == "uscale"  ? &scale.x
                     : property.name == "vscale"  ? &scale.y
                                                  : nullptr;
    const auto* value = std::get_if<double>(&property.value);
    if (!target || !value) return false;
    *target = *value;
    where = property.where;
    return true;
  });
  if (!where.file) return;
  Imath::M44d translation, scaling;
  translation.setTranslation(offset);
  scaling.setScale(scale);
  object.properties.push_back({"to_uv", Transform{{0, translation * scaling}}, where});
}

void Builder::resolve() {
  for (const Alias& alias : m_aliases) {
    const auto original = m_ids.find(alias.id);
    if (original == m_ids.end()) fail(alias.where, "there is no object with id=\"{}\"", alias.id);
    if (!m_ids.emplace(alias.as, original->second).second) fail(alias.where, "the id \"{}\" is taken", alias.as);
  }
  for (const PendingReference& reference : m_references) {
    Property& property = m_tree.objects[reference.object]->properties[reference.property];
    const auto target = m_ids.find(reference.id);
    if (target == m_ids.end()) {
      std::vector<std::string_view> known;
      for (const auto& [id, index] : m_ids) known.push_back(id);
      std::sort(known.begin(), known.end());
      if (known.size() > 12) {  // a long list helps nobody: only a near miss is worth showing
        const std::string hint = suggestion(reference.id, known);
        if (hint.find("did you mean") == std::string::npos)
          fail(property.where, "there is no object with id=\"{}\"", reference.id);
      }
      fail(property.where, "there is no object with id=\"{}\";{}", reference.id,
           known.empty() ? " nothing in the scene has an id" : suggestion(reference.id, known));
    }
    property.value = static_cast<const Object*>(m_tree.objects[target->second].get());
  }
}

void Builder::check_cycles() {
  enum class State : std::uint8_t { unseen, open, done };
  std::unordered_map<const Object*, State> states;
  const auto visit = [&](const auto& self, const Object& object) -> void {
    states[&object] = State::open;
    for (const Property& property : object.properties) {
      const auto* child = std::get_if<const Object*>(&property.value);
      if (!child) continue;
      const State state = states[*child];
      if (state == State::open)
        fail(property.where, "circular reference: {} \"{}\" contains itself", (*child)->tag, (*child)->id);
      if (state == State::unseen) self(self, **child);
    }
    states[&object] = State::done;
  };
  visit(visit, m_tree.scene());
}

}  // namespace

ObjectTree build_objects(const XmlElement& root) { return Builder().build(root); }

}  // namespace warpath
