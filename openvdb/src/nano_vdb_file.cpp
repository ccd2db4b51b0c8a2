// Writes level sets as files of NanoVDB.
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <span>
#include <sstream>

#include "level_set_grid.h"

namespace hpsdf::vdb {

LevelSetFigures writeNanoVdb(const Field& field, const LevelSetOptions& options, OutputFile& out,
                             const Progress& progress) {
  const openvdb::FloatGrid::Ptr grid = makeLevelSet(field, options, progress);
  progress.update("writing", 0);
  const auto handle = nanovdb::openToNanoVDB(*grid, nanovdb::StatsMode::All, nanovdb::ChecksumMode::Full);
  // NanoVDB's own function needs a stream in which it can seek beyond the end.
  nanovdb::io::Segment segment(nanovdb::io::Codec::NONE);
  segment.add(handle);
  segment.meta.front().fileSize = handle.size();
  std::ostringstream header(std::ios::binary);
  segment.write(header);
  out.write(header.view());
  out.write(std::as_bytes(std::span(handle.data(), handle.size())));
  out.flush();
  return figuresOf(*grid);
}

}  // namespace hpsdf::vdb
