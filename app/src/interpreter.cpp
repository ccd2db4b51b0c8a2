#include "hpsdf/app/interpreter.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

#include "commands/commands.h"
#include "console/console.h"
#include "construction/operands.h"
#include "language/registry.h"
#include "language/script.h"
#include "session/session.h"

namespace hpsdf::app {
namespace {

const Registry& commandRegistry() {
  static const Registry registry = makeRegistry();
  return registry;
}

/// Passes reports of long work on to a `Progress`, and its wish to cancel back to the work.
class ProgressListener : public WorkListener {
 public:
  explicit ProgressListener(const Progress& progress) : progress_(progress) {}
  void report(std::string_view task, double fraction) override {
    if (progress_.report) progress_.report(task, fraction);
  }
  bool wantsCancel() override { return progress_.cancelled && progress_.cancelled(); }
  void ended() override {}

 private:
  const Progress& progress_;
};

/// Observes the work of a session for the lifetime of this object.
class Listening {
 public:
  Listening(Session& session, const Progress& progress) : session_(session), listener_(progress) {
    session_.setListener(&listener_);
  }
  ~Listening() { session_.setListener(nullptr); }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

 private:
  Session& session_;
  ProgressListener listener_;
};

/// Parses the options of a call. What the parser says of a word is an error about an option for the host.
Arguments argumentsOf(const Command& command, std::span<const Option> options) {
  std::vector<Word> words;
  for (const Option& option : options)
    words.push_back({.text = option.name + "=" + option.value, .equals = option.name.size()});
  try {
    return parseArguments(command, words, Origin::script);
  } catch (const ArgumentError& error) {
    throw Error(ErrorKind::option, "", error.what());
  }
}

/// Returns a command of the registry without the file that it writes its picture to.
Command drawingCommand(std::string_view name) {
  Command command = commandRegistry().command(name);
  if (!command.draw) throw Error(ErrorKind::option, command.name, "draws no picture");
  command.parameters = without({"output"}, std::move(command.parameters));
  return command;
}

}  // namespace

std::vector<OptionDescription> optionsOf(std::string_view name) {
  const Command& command = commandRegistry().command(name);
  std::vector<OptionDescription> options;
  for (const Parameter& parameter : command.parameters) {
    if (parameter.type == ParameterType::outputPath || parameter.name == "json") continue;
    options.push_back({parameter.name, expectedValue(parameter), parameter.defaultText, parameter.help});
  }
  return options;
}

Expression loadedOperand(const std::string& name, InsideTest insideTest, const Progress& progress) {
  std::istringstream in;
  std::ostringstream out, err;
  ProgressListener listener(progress);
  const Console console{.in = in, .out = out, .err = err, .listener = &listener, .writesProgress = false};
  return withLoadedOperands(console, Expression::named(name), insideTest);
}

struct Interpreter::State {
  std::istringstream in;
  std::ostringstream out, err;
  std::map<std::string, TriangleMesh, std::less<>> meshes;
  Session session{commandRegistry(),
                  Console{.in = in, .out = out, .err = err, .meshes = &meshes, .writesProgress = false}};

  std::string takeOutput() { return std::exchange(out, std::ostringstream{}).str(); }
};

Interpreter::Interpreter() : state_(std::make_unique<State>()) {}
Interpreter::~Interpreter() = default;

void Interpreter::setField(Field field, const std::string& name) {
  state_->session.setField({.field = std::move(field), .name = name});
}

const Field* Interpreter::field() const {
  return state_->session.hasField() ? &state_->session.current().field : nullptr;
}

void Interpreter::setMesh(const std::string& name, TriangleMesh mesh) {
  const auto known = state_->meshes.find(name);
  if (known != state_->meshes.end() && fingerprint(known->second) == fingerprint(mesh)) return;
  state_->meshes.insert_or_assign(name, std::move(mesh));
  state_->session.forgetSurfaces();
}

std::string Interpreter::perform(std::string_view name, std::span<const Option> options, const Progress& progress) {
  const Command& command = commandRegistry().command(name);
  const Arguments arguments = argumentsOf(command, options);
  const Listening listening(state_->session, progress);
  state_->takeOutput();  // drops what a command printed that failed
  app::perform(command, state_->session, arguments);
  return state_->takeOutput();
}

std::string Interpreter::run(std::string_view name, std::string_view script, std::span<const Option> variables,
                             bool json, const Progress& progress) {
  Session& session = state_->session;
  Variables values;
  for (const Option& variable : variables) values.insert_or_assign(variable.name, variable.value);
  const std::vector<Call> calls = parseScript(commandRegistry(), name, script, std::move(values));
  const Listening listening(session, progress);
  state_->takeOutput();
  const ScriptScope scope(session, json);
  for (const Call& call : calls) {
    progress.throwIfCancelled();
    runScript(session, std::span(&call, 1));
  }
  return state_->takeOutput();
}

render::Image Interpreter::draw(std::string_view name, std::span<const Option> options, const Progress& progress) {
  const Command command = drawingCommand(name);
  const Arguments arguments = argumentsOf(command, options);
  const Listening listening(state_->session, progress);
  return drawn(command, state_->session, arguments);
}

std::string Interpreter::takeOutput() { return state_->takeOutput(); }

std::string Interpreter::takeNotes() { return std::exchange(state_->err, std::ostringstream{}).str(); }

}  // namespace hpsdf::app
