#pragma once
// Functions that write the texts of captions.

#include <string>
#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "picture/cracks.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// A vector as text, as in "(1, −0.5, 2)".
std::string formatVector(const Vector3& v, int digits = 4);

/// The name of the field's source, for example of its mesh, or "unnamed field".
std::string describeSource(const Field& field);

/// The field's target error as text, as in "τ = 1e-5".
std::string describeTarget(const Field& field);

/// A plane as text, as in "slice z = 0.1" for the name "slice".
std::string describePlane(const std::string& name, const Plane& plane);

/// The chosen cells as text, as in "cells of degree 2, 4–6".
std::string describeCells(const ShownCells& cells);

std::string describeCamera(const OrbitCamera& camera);
std::string describeCracks(const Cracks& cracks);

/// The range of degrees or depths as text, from the lowest to the highest, as in "3–7" or "3–7, exact".
std::string describeLevels(const std::map<int, double>& shares);

/// A number of bytes as text, as in "12.3 kB".
std::string describeBytes(std::size_t bytes);

/// Returns the greatest value as text, as in "up to 0.01". Ignores values that are NaN.
std::string describeGreatest(const std::vector<float>& values);

}  // namespace hpsdf::render
