#pragma once
// A guess at the axis that points up, for surfaces whose files do not say it.

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// Guesses which of the axes y and z, which files of surfaces use, points up: the one below whose lowest points the
/// surface has the larger base, in which the area between separate feet counts. Takes y if neither base is clearly
/// larger.
render::UpAxis guessedUp(const TriangleMesh& mesh);

/// The same for the surface of a field, which is sampled in some 10,000 points.
render::UpAxis guessedUp(const Field& field);

}  // namespace hpsdf::app
