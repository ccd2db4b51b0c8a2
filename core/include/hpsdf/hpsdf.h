#pragma once
// Includes all public headers of the library hpsdf::core: meshes, exact distances, fields and their construction,
// queries and error measures.

#include "hpsdf/build.h"
#include "hpsdf/build_options.h"
#include "hpsdf/cell_history.h"
#include "hpsdf/continuity.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_repair.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/range.h"
#include "hpsdf/safe_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "hpsdf/verify.h"
