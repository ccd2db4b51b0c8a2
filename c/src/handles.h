#pragma once
// The contents of the opaque objects of the C interface.

#include "hpsdf.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

struct hpsdf_mesh {
  hpsdf::TriangleMesh mesh;
};

struct hpsdf_distance {
  hpsdf::ExactDistance distance;
};

struct hpsdf_options {
  hpsdf::GivenSettings settings;
};

struct hpsdf_field {
  hpsdf::Field field;
};
