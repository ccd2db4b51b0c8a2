// Runs commands. The registry and the parser of scripts are in files of their own, because fuzz targets need them
// without the renderer.

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "console/failed.h"
#include "hpsdf/render/renderer.h"
#include "language/registry.h"
#include "language/script.h"

namespace hpsdf::app {
namespace {

std::vector<std::string> inputFiles(const Command& command, const Arguments& arguments) {
  std::vector<std::string> files;
  for (const Parameter& parameter : command.parameters) {
    const bool isInput = parameter.type == ParameterType::path || parameter.type == ParameterType::text;
    if (isInput && !parameter.isRepeatable && arguments.given(parameter.name))
      files.push_back(arguments.text(parameter.name));
  }
  return files;
}

/// Returns how the command draws without OpenGL, as `render::GlError::advising` takes it.
std::string cpuMeans(const Command& command) {
  if (findParameter(command, "cpu") != nullptr) return "with --cpu";
  return command.drawsOnCpuBy.empty() ? "on the CPU" : "with " + command.drawsOnCpuBy;
}

}  // namespace

void perform(const Command& command, Session& session, const Arguments& arguments) {
  for (const std::string& output : outputFiles(command, arguments))
    for (const std::string& input : inputFiles(command, arguments)) {
      std::error_code missing;
      if (std::filesystem::equivalent(output, input, missing))
        throw Error(fmt::format("{}: is read by the same command; give the output another name", output));
    }
  try {
    command.action(session, arguments);
  } catch (const render::GlError& error) {
    throw Error(error.kind(), error.subject(), error.advising(cpuMeans(command)));
  }
}

void runScript(Session& session, std::span<const Call> calls) {
  for (const Call& call : calls) {
    try {
      perform(*call.command, session, call.arguments);
    } catch (const Failed& error) {
      throw Failed(call.where + ": " + error.what() + call.includedFrom, error.status());
    } catch (const Error& error) {
      throw Error(call.where + ": " + error.what() + call.includedFrom);
    }
  }
}

}  // namespace hpsdf::app
