#pragma once
#include <Imath/ImathMatrix.h>

#include <vector>

#include "core/math.h"
#include "scene/xml.h"

namespace warpath {

/// A matrix (Imath's row vectors) at a time. Scene files are composed in double precision.
struct Keyframe {
  double time = 0;
  Imath::M44d matrix;
};
/// One keyframe, or two with increasing times.
using Transform = std::vector<Keyframe>;

/// <transform>: its children in order, each applied after those before it.
Transform parse_transform(const XmlElement& element);
/// <animation>: two <transform time="...">.
Transform parse_animation(const XmlElement& element);

/// The matrix at a time: entries interpolated linearly, held before the first and after the last keyframe.
Matrix4 matrix_at(const Transform& transform, double time);
Matrix4 to_single(const Imath::M44d& matrix);

Imath::M44d look_at(const Imath::V3d& origin, const Imath::V3d& target, const Imath::V3d& up);
/// Two unit vectors that complete the unit vector n to a right-handed basis (s, t, n), as Mitsuba 3 chooses them
/// (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017).
std::pair<Imath::V3d, Imath::V3d> coordinate_system(const Imath::V3d& n);

/// The numbers of a list separated by blanks and commas; SceneError naming the one that is no number.
std::vector<double> parse_numbers(std::string_view text, const Location& where);
double parse_number(std::string_view text, const Location& where);

}  // namespace warpath
