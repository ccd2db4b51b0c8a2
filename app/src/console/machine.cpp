#include "console/machine.h"

#include <assimp/version.h>
#include <fmt/format.h>

#include <fstream>

namespace hpsdf::app {

std::vector<std::pair<std::string, bool>> simdOfCpu() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
  return {{"sse4.2", __builtin_cpu_supports("sse4.2") != 0},
          {"avx2", __builtin_cpu_supports("avx2") != 0},
          {"avx512", __builtin_cpu_supports("avx512f") != 0}};
#else
  return {};
#endif
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) return line.substr(line.find(": ") + 2);
  return "unknown";
}

std::string compilerText() {
#if defined(__clang__)
  return fmt::format("clang {}", __clang_version__);
#elif defined(__GNUC__)
  return fmt::format("g++ {}", __VERSION__);
#else
  return "unknown";
#endif
}

std::string assimpVersion() {
  return fmt::format("{}.{}.{}", aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch());
}

}  // namespace hpsdf::app
