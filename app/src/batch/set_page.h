#pragma once
// The page of a folder of fields that a batch has built.

#include <string>
#include <vector>

#include "text/json.h"

namespace hpsdf::app {

/// One mesh on the page.
struct SetMesh {
  Json record;                       ///< what became of it, as `build --batch` keeps it
  std::string name;                  ///< beginning of the names of its files
  std::vector<std::string> endings;  ///< what follows `name` in these names: ".hpsdf", ".json", ".png", …
};

/// Returns an HTML page with all meshes: a table with pictures that can be searched and sorted, with links to the files
/// of each mesh, whose addresses are relative to the page, and sums of the whole set. The page needs JavaScript and no
/// network.
std::string setPage(const std::string& title, const std::vector<SetMesh>& meshes);

}  // namespace hpsdf::app
