#pragma once
// What a run of the program came to.

#include <sstream>
#include <string>
#include <vector>

#include "program.h"

namespace hpsdf::app {

struct Outcome {
  int status = -1;  ///< exit status; of a process of its own -signal where one ended it
  std::string out;
  std::string err;
};

/// Within this process, with nothing on standard input.
inline Outcome runHere(const std::vector<std::string>& words) {
  std::istringstream in;
  std::ostringstream out, err;
  const int status = runProgram(words, Console{in, out, err});
  return {status, out.str(), err.str()};
}

}  // namespace hpsdf::app
