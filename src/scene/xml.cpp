#include "scene/xml.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <pugixml.hpp>

namespace warpath {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxIncludeDepth = 15;  // as Mitsuba 3

struct Parameter {
  std::string name, value;
  bool used = false;
  bool from_command_line = false;
};

bool is_name_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

class Reader {
 public:
  explicit Reader(const std::vector<std::pair<std::string, std::string>>& defines) {
    for (const auto& [name, value] : defines) set_parameter({name, value, false, true});
  }

  XmlElement read_file(const fs::path& path, const Location* included_from, int depth);
  void check_defines(const fs::path& scene) const;
  std::vector<fs::path>& folders() { return m_folders; }

 private:
  void set_parameter(Parameter parameter);
  std::string substitute(std::string_view text, const Location& where);
  void convert(pugi::xml_node node, const std::shared_ptr<const SourceFile>& file, int depth, XmlElement& parent);
  void include(const XmlElement& element, int depth, XmlElement& parent);
  void add_folder(const XmlElement& element);

  std::vector<Parameter> m_parameters;  // longest name first: $spp must not be found in $spp_max
  std::vector<fs::path> m_folders;
};

void Reader::set_parameter(Parameter parameter) {
  const auto place = std::find_if(m_parameters.begin(), m_parameters.end(),
                                  [&](const Parameter& p) { return p.name.size() < parameter.name.size(); });
  m_parameters.insert(place, std::move(parameter));
}

/// Replaces $name; \$ stands for a dollar sign. Replaced text is not looked at again for the same name.
std::string Reader::substitute(std::string_view text, const Location& where) {
  if (text.find('$') == std::string_view::npos) return std::string(text);
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == '$') {
      result += '$';
      i += 2;
      continue;
    }
    if (text[i] != '$') {
      result += text[i++];
      continue;
    }
    const std::string_view rest = text.substr(i + 1);
    const auto parameter = std::find_if(m_parameters.begin(), m_parameters.end(),
                                        [&](const Parameter& p) { return rest.substr(0, p.name.size()) == p.name; });
    if (parameter == m_parameters.end()) {
      const auto end = std::find_if_not(rest.begin(), rest.end(), is_name_character);
      const std::string_view name = rest.substr(0, static_cast<std::size_t>(end - rest.begin()));
      std::vector<std::string_view> known;
      for (const Parameter& p : m_parameters) known.push_back(p.name);
      if (known.empty()) fail(where, "undefined parameter \"${}\"; give it a <default> or -D {}=...", name, name);
      fail(where, "undefined parameter \"${}\";{}", name, suggestion(name, known));
    }
    parameter->used = true;
    result += parameter->value;
    i += 1 + parameter->name.size();
  }
  return result;
}

std::string read_text(const fs::path& path, const Location* included_from) {
  std::ifstream stream(path, std::ios::binary);
  std::error_code error;
  if (!stream || fs::is_directory(path, error)) {
    const std::string reason = fs::is_directory(path, error) ? "is a folder, not a scene file" : "cannot be opened";
    if (included_from) fail(*included_from, "included file \"{}\" {}", path.string(), reason);
    throw SceneError(
        fmt::format("{}: {}", path.string(), fs::exists(path, error) ? reason : std::string("no such scene file")));
  }
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

XmlElement Reader::read_file(const fs::path& path, const Location* included_from, int depth) {
  auto file = std::make_shared<SourceFile>();
  file->path = path;
  file->text = read_text(path, included_from);

  pugi::xml_document document;
  const auto parsed =
      document.load_buffer(file->text.data(), file->text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) fail({file, static_cast<std::size_t>(parsed.offset)}, "not well-formed XML: {}", parsed.description());
  const pugi::xml_node root = document.document_element();
  const Location where{file, static_cast<std::size_t>(root.offset_debug() - 1)};
  const pugi::xml_attribute version = root.attribute("version");
  if (!version) fail(where, "the root element <{}> has no version; write version=\"3.0.0\"", root.name());
  char* end = nullptr;
  file->major_version = static_cast<int>(std::strtol(version.value(), &end, 10));
  if (end == version.value()) fail(where, "version \"{}\" is not a number like 3.0.0", version.value());

  XmlElement holder;
  convert(root, file, depth, holder);
  if (holder.children.empty()) fail(where, "unexpected root element <{}>; a scene file has <scene>", root.name());
  return std::move(holder.children.front());
}

void Reader::include(const XmlElement& element, int depth, XmlElement& parent) {
  element.check_attributes({"filename", "name"});
  if (depth >= kMaxIncludeDepth)
    fail(element.where, "includes are nested more than {} deep; does a file include itself?", kMaxIncludeDepth);
  const fs::path name = element.required_attribute("filename");
  std::vector<fs::path> folders = m_folders;
  folders.insert(folders.begin(), element.where.file->path.parent_path());
  XmlElement root = read_file(find_file(folders, name), &element.where, depth + 1);
  if (root.tag == "scene") {
    std::move(root.children.begin(), root.children.end(), std::back_inserter(parent.children));
    return;
  }
  if (const std::string* as = element.attribute("name")) {
    std::erase_if(root.attributes, [](const auto& a) { return a.first == "name"; });
    root.attributes.emplace_back("name", *as);
  }
  std::erase_if(root.attributes, [](const auto& a) { return a.first == "version"; });
  parent.children.push_back(std::move(root));
}

void Reader::add_folder(const XmlElement& element) {
  element.check_attributes({"value"});
  const fs::path value = element.required_attribute("value");
  std::vector<fs::path> folders = m_folders;
  folders.insert(folders.begin(), element.where.file->path.parent_path());
  const fs::path folder = find_file(folders, value);
  if (!fs::is_directory(folder)) fail(element.where, "<path>: there is no folder \"{}\"", value.string());
  m_folders.insert(m_folders.begin(), folder);
}

void Reader::convert(pugi::xml_node node, const std::shared_ptr<const SourceFile>& file, int depth,
                     XmlElement& parent) {
  XmlElement element;
  element.tag = node.name();
  // pugixml points at the name, people count from the bracket before it.
  element.where = {file, static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug() - 1, 0))};
  for (const pugi::xml_attribute attribute : node.attributes()) {
    if (element.attribute(attribute.name())) fail(element.where, "attribute \"{}\" is given twice", attribute.name());
    element.attributes.emplace_back(attribute.name(), substitute(attribute.value(), element.where));
  }

  if (element.tag == "include") return include(element, depth, parent);
  if (element.tag == "path") return add_folder(element);
  if (element.tag == "default") {
    element.check_attributes({"name", "value"});
    const std::string& name = element.required_attribute("name");
    if (name.empty()) fail(element.where, "<default> needs a name");
    const bool known =
        std::any_of(m_parameters.begin(), m_parameters.end(), [&](const Parameter& p) { return p.name == name; });
    if (!known) set_parameter({name, element.required_attribute("value"), true, false});
    return;
  }
  for (const pugi::xml_node child : node.children()) {
    if (child.type() == pugi::node_element) convert(child, file, depth, element);
    if (child.type() == pugi::node_pcdata)
      fail({file, static_cast<std::size_t>(std::max<std::ptrdiff_t>(child.offset_debug(), 0))},
           "text between elements: \"{}\"", std::string_view(child.value()).substr(0, 30));
  }
  parent.children.push_back(std::move(element));
}

void Reader::check_defines(const fs::path& scene) const {
  for (const Parameter& unused : m_parameters) {
    if (!unused.from_command_line || unused.used) continue;
    std::vector<std::string_view> known;
    for (const Parameter& p : m_parameters)
      if (p.used) known.push_back(p.name);
    throw ConfigError(fmt::format("-D {}={}: {} has no parameter \"{}\";{}", unused.name, unused.value, scene.string(),
                                  unused.name, known.empty() ? " it has none" : suggestion(unused.name, known)));
  }
}

}  // namespace

std::string to_string(const Location& where) {
  if (!where.file) return "scene";
  const std::string_view text = std::string_view(where.file->text).substr(0, where.offset);
  const auto line = std::count(text.begin(), text.end(), '\n') + 1;
  const std::size_t newline = text.rfind('\n');
  const std::size_t column = text.size() - (newline == std::string_view::npos ? 0 : newline + 1) + 1;
  return fmt::format("{}:{}:{}", where.file->path.string(), line, column);
}

const std::string* XmlElement::attribute(std::string_view name) const {
  for (const auto& [key, value] : attributes)
    if (key == name) return &value;
  return nullptr;
}

const std::string& XmlElement::required_attribute(std::string_view name) const {
  const std::string* value = attribute(name);
  if (!value) fail(where, "<{}> needs the attribute \"{}\"", tag, name);
  return *value;
}

void XmlElement::check_attributes(std::initializer_list<std::string_view> known) const {
  for (const auto& [key, value] : attributes)
    if (std::find(known.begin(), known.end(), key) == known.end())
      fail(where, "<{}> has no attribute \"{}\";{}", tag, key, suggestion(key, {known.begin(), known.size()}));
}

XmlDocument read_scene_xml(const fs::path& file, const std::vector<std::pair<std::string, std::string>>& defines) {
  Reader reader(defines);
  reader.folders().push_back(file.parent_path());
  XmlDocument document;
  document.root = reader.read_file(file, nullptr, 0);
  if (document.root.tag != "scene")
    fail(document.root.where, "the root element is <{}>; a scene file has <scene>", document.root.tag);
  reader.check_defines(file);
  document.folders = std::move(reader.folders());
  return document;
}

fs::path find_file(const std::vector<fs::path>& folders, const fs::path& name) {
  if (name.is_absolute()) return name;
  std::error_code error;
  for (const fs::path& folder : folders)
    if (fs::exists(folder / name, error)) return folder / name;
  return folders.empty() ? name : folders.back() / name;
}

}  // namespace warpath
