#pragma once
// The files that windows have opened, remembered from one start of the program to the next.

#include <string>
#include <vector>

namespace hpsdf::app {

/// Returns the remembered files that still exist, the last one first; the names of files within the current folder
/// are relative to it. Returns no files where the list cannot be read.
std::vector<std::string> recentFiles();

/// Puts a file at the beginning of the list, which keeps ten files. Does nothing for a name that is no file, and where
/// the list cannot be written. The list is the file `hpsdf/recent` in the folder that XDG_STATE_HOME names, or in
/// ~/.local/state.
void rememberFile(const std::string& file);

}  // namespace hpsdf::app
