#include "scene/transform.h"

#include <charconv>
#include <cmath>

#include "core/log.h"

namespace warpath {
namespace {

using Imath::M44d;
using Imath::V3d;

/// value="1 2 3", value="2" for all three, or x, y and z, each with its default.
V3d parse_xyz(const XmlElement& element, double missing) {
  const Location& where = element.where;
  if (const std::string* value = element.attribute("value")) {
    if (element.attribute("x") || element.attribute("y") || element.attribute("z"))
      fail(where, "<{}> has both \"value\" and \"x\", \"y\" or \"z\"", element.tag);
    const auto v = parse_numbers(*value, where);
    if (v.size() == 1) return V3d(v[0]);
    if (v.size() == 3) return V3d(v[0], v[1], v[2]);
    fail(where, "<{}> needs one or three numbers, not {}", element.tag, v.size());
  }
  V3d result;
  for (int i = 0; i < 3; ++i) {
    const char name[] = {"xyz"[i], '\0'};
    const std::string* text = element.attribute(name);
    result[i] = text ? parse_number(*text, where) : missing;
  }
  return result;
}

V3d parse_point(const XmlElement& element, std::string_view attribute) {
  const auto v = parse_numbers(element.required_attribute(attribute), element.where);
  if (v.size() != 3) fail(element.where, "\"{}\" needs three numbers, not {}", attribute, v.size());
  return V3d(v[0], v[1], v[2]);
}

bool is_finite(const M44d& m) {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (!std::isfinite(m[i][j])) return false;
  return true;
}

M44d parse_matrix(const XmlElement& element) {
  element.check_attributes({"value"});
  const auto v = parse_numbers(element.required_attribute("value"), element.where);
  if (v.size() != 16 && v.size() != 9) fail(element.where, "<matrix> needs 16 or 9 numbers, not {}", v.size());
  const int n = v.size() == 16 ? 4 : 3;
  M44d m;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) m[column][row] = v[static_cast<std::size_t>(row * n + column)];
  if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1)
    fail(element.where, "<matrix> is not affine: its last row must be 0 0 0 1");
  return m;
}

M44d parse_operation(const XmlElement& element) {
  M44d m;
  if (element.tag == "matrix") {
    m = parse_matrix(element);
  } else if (element.tag == "translate") {
    element.check_attributes({"value", "x", "y", "z"});
    m.setTranslation(parse_xyz(element, 0));
  } else if (element.tag == "scale") {
    element.check_attributes({"value", "x", "y", "z"});
    m.setScale(parse_xyz(element, 1));
  } else if (element.tag == "rotate") {
    element.check_attributes({"value", "x", "y", "z", "angle"});
    const V3d axis = parse_xyz(element, 0);
    if (axis.length2() == 0) fail(element.where, "<rotate> needs an axis; write y=\"1\" for the y axis");
    if (std::abs(axis.length() - 1) > 1e-3)
      log::warn("{}: the axis of <rotate> is made a unit vector; Mitsuba 3 would distort the object",
                to_string(element.where));
    m.setAxisAngle(axis, parse_number(element.required_attribute("angle"), element.where) * M_PI / 180);
  } else if (element.tag == "lookat" || element.tag == "lookAt") {
    element.check_attributes({"origin", "target", "up"});
    const V3d origin = parse_point(element, "origin"), target = parse_point(element, "target");
    V3d up = element.attribute("up") ? parse_point(element, "up") : V3d(0);
    if ((target - origin).length2() == 0) fail(element.where, "<lookat> looks nowhere: origin and target are the same");
    if (up.length2() == 0) up = coordinate_system((target - origin).normalized()).first;
    m = look_at(origin, target, up);
    if (!is_finite(m) || m[0][0] * m[0][0] + m[0][1] * m[0][1] + m[0][2] * m[0][2] == 0)
      fail(element.where, "<lookat> has no sideways direction: up is parallel to the line of sight");
  } else {
    constexpr std::string_view kKnown[] = {"translate", "rotate", "scale", "lookat", "matrix"};
    fail(element.where, "unexpected <{}> in a transform;{}", element.tag, suggestion(element.tag, kKnown));
  }
  if (!element.children.empty())
    fail(element.children[0].where, "<{}> cannot stand in <{}>", element.children[0].tag, element.tag);
  if (!is_finite(m)) fail(element.where, "<{}> has numbers that are not finite", element.tag);
  return m;
}

M44d parse_operations(const XmlElement& element) {
  M44d result;
  for (const XmlElement& child : element.children) result = result * parse_operation(child);
  return result;
}

}  // namespace

Transform parse_transform(const XmlElement& element) {
  element.check_attributes({"name"});
  return {{0, parse_operations(element)}};
}

Transform parse_animation(const XmlElement& element) {
  element.check_attributes({"name"});
  Transform result;
  for (const XmlElement& child : element.children) {
    if (child.tag != "transform")
      fail(child.where, "unexpected <{}> in <animation>; it holds two <transform>", child.tag);
    child.check_attributes({"time"});
    result.push_back({parse_number(child.required_attribute("time"), child.where), parse_operations(child)});
  }
  if (result.size() != 2)
    fail(element.where, "<animation> needs two <transform time=\"...\">, not {}; more keyframes are not supported yet",
         result.size());
  if (!(result[0].time < result[1].time)) fail(element.where, "the times in <animation> must increase");
  return result;
}

Matrix4 to_single(const M44d& matrix) { return Matrix4(matrix); }

Matrix4 matrix_at(const Transform& transform, double time) {
  if (transform.size() < 2 || time <= transform.front().time) return to_single(transform.front().matrix);
  const Keyframe &a = transform[0], &b = transform[1];
  if (time >= b.time) return to_single(b.matrix);
  const double t = (time - a.time) / (b.time - a.time);
  return to_single(a.matrix * (1 - t) + b.matrix * t);
}

M44d look_at(const V3d& origin, const V3d& target, const V3d& up) {
  const V3d forward = (target - origin).normalized();
  const V3d left = up.cross(forward).normalized();
  const V3d new_up = forward.cross(left);
  return M44d(left.x, left.y, left.z, 0, new_up.x, new_up.y, new_up.z, 0, forward.x, forward.y, forward.z, 0, origin.x,
              origin.y, origin.z, 1);
}

std::pair<V3d, V3d> coordinate_system(const V3d& n) {
  const double sign = std::copysign(1.0, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {V3d(1 + sign * n.x * n.x * a, sign * b, -sign * n.x), V3d(b, sign + n.y * n.y * a, -n.y)};
}

double parse_number(std::string_view text, const Location& where) {
  const auto numbers = parse_numbers(text, where);
  if (numbers.size() != 1) fail(where, "\"{}\" is not one number", text);
  return numbers[0];
}

std::vector<double> parse_numbers(std::string_view text, const Location& where) {
  constexpr std::string_view kSeparators = " ,\t\r\n";
  std::vector<double> result;
  for (std::size_t begin = text.find_first_not_of(kSeparators); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, begin), text.size());
    std::string_view word = text.substr(begin, end - begin);
    if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
    double value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    // Exponents of three digits underflow in exported files (5.48452e-322): what is too small is zero.
    const bool underflow = error == std::errc::result_out_of_range && word.find("e-") != std::string_view::npos;
    if ((error != std::errc() && !underflow) || stop != word.data() + word.size())
      fail(where, "\"{}\" is not a number", word);
    result.push_back(underflow ? 0 : value);
    begin = text.find_first_not_of(kSeparators, end);
  }
  return result;
}

}  // namespace warpath
