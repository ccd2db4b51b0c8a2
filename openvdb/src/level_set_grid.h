#pragma once

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

#include <sstream>

#include "hpsdf/openvdb/level_set.h"

namespace hpsdf::vdb {

/// Makes the level set of a field as a grid of OpenVDB (`writeVdb` describes it).
openvdb::FloatGrid::Ptr makeLevelSet(const Field& field, const LevelSetOptions& options, const Progress& progress);

LevelSetFigures figuresOf(const openvdb::FloatGrid& grid);

}  // namespace hpsdf::vdb
