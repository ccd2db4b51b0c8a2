#pragma once
// The texts of captions.

#include <string>
#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "picture/cracks.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// "(1, −0.5, 2)".
std::string formatVector(const Vector3& v, int digits = 4);

/// The name of the field's source.
std::string describeSource(const Field& field);

/// "τ = 1e-5".
std::string describeTarget(const Field& field);

/// "slice z = 0.1", with "slice" as the name.
std::string describePlane(const std::string& name, const Plane& plane);

/// "cells of degree 2, 4–6".
std::string describeCells(const ShownCells& cells);

std::string describeCamera(const OrbitCamera& camera);
std::string describeCracks(const Cracks& cracks);

/// "3–7", from the least to the greatest of these levels.
std::string describeLevels(const std::map<int, double>& shares);

/// "12.3 kB".
std::string describeBytes(std::size_t bytes);

/// "up to 0.01", of the values that are not NaN.
std::string describeGreatest(const std::vector<float>& values);

}  // namespace hpsdf::render
