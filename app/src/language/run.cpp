// Runs commands. The registry and the parser of scripts are in files of their own, because fuzz targets need them
// without the renderer.

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "hpsdf/app/failed.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/renderer.h"
#include "language/registry.h"
#include "language/script.h"

namespace hpsdf::app {
namespace {

std::vector<std::string> inputFiles(const Command& command, const Arguments& arguments) {
  std::vector<std::string> files;
  for (const Parameter& parameter : command.parameters) {
    const bool isInput = parameter.type == ParameterType::path || parameter.type == ParameterType::text;
    if (!isInput || !arguments.given(parameter.name)) continue;
    for (const std::string& file : arguments.texts(parameter.name)) files.push_back(file);
  }
  return files;
}

/// Returns how the command draws without OpenGL, as `render::GlError::advising` takes it.
std::string cpuMeans(const Command& command) {
  if (findParameter(command, "cpu") != nullptr) return "with --cpu";
  return command.drawsOnCpuBy.empty() ? "on the CPU" : "with " + command.drawsOnCpuBy;
}

/// Does the work. If OpenGL cannot draw, throws an `Error` that says how the command draws without it.
template <typename Work>
auto advisingOnGl(const Command& command, const Work& work) {
  try {
    return work();
  } catch (const render::GlError& error) {
    throw Error(error.kind(), error.subject(), error.advising(cpuMeans(command)));
  }
}

}  // namespace

void perform(const Command& command, Session& session, const Arguments& arguments) {
  for (const std::string& output : outputFiles(command, arguments))
    for (const std::string& input : inputFiles(command, arguments)) {
      std::error_code missing;
      if (std::filesystem::equivalent(output, input, missing))
        throw Error(fmt::format("{}: is read by the same command; give the output another name", output));
    }
  advisingOnGl(command, [&] { command.action(session, arguments); });
}

render::Image drawn(const Command& command, Session& session, const Arguments& arguments) {
  return advisingOnGl(command, [&] { return command.draw(session, arguments); });
}

void runScript(Session& session, std::span<const Call> calls) {
  for (const Call& call : calls) {
    try {
      perform(*call.command, session, call.arguments);
    } catch (const Failed& error) {
      throw Failed(call.where + ": " + error.what() + call.includedFrom, error.status());
    } catch (const Error& error) {
      throw Error(error.kind(), call.where, error.what() + call.includedFrom);
    }
  }
}

}  // namespace hpsdf::app
