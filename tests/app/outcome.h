#pragma once
// The result of a run of the program.

#include <sstream>
#include <string>
#include <vector>

#include "program.h"

namespace hpsdf::app {

struct Outcome {
  int status = -1;  ///< exit status, or minus the number of the signal that ended the process
  std::string out;
  std::string err;
};

/// Runs the program's main function in this process, with empty standard input.
inline Outcome runHere(const std::vector<std::string>& words) {
  std::istringstream in;
  std::ostringstream out, err;
  const int status = runProgram(words, Console{in, out, err});
  return {status, out.str(), err.str()};
}

}  // namespace hpsdf::app
