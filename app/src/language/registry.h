#pragma once
// The registry describes every command of the program once: parameters with types, ranges, defaults and help texts.
// Scripts, the command line, the help and docs/commands.md are all derived from it.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/error.h"
#include "language/parameter.h"

namespace hpsdf::app {

class Session;

/// The validated values of one call.
class Arguments {
 public:
  /// True where the caller wrote the parameter; false where its default applies.
  bool given(std::string_view name) const;
  /// True where the parameter has a value, written by the caller or by default.
  bool has(std::string_view name) const;

  std::string text(std::string_view name) const;
  /// Returns `fallback` where the parameter has no value.
  std::string textOr(std::string_view name, std::string fallback) const;
  std::vector<std::string> texts(std::string_view name) const;
  double number(std::string_view name) const;
  int whole(std::string_view name) const;
  std::vector<double> numbers(std::string_view name) const;
  bool flag(std::string_view name) const;
  std::array<int, 2> size(std::string_view name) const;

 private:
  friend class ArgumentReader;
  struct Value {
    std::string text = {};
    std::vector<double> numbers = {};
  };
  struct Entry {
    bool given = false;
    std::vector<Value> values = {};
  };
  const Value& single(std::string_view name) const;
  const Entry& entry(std::string_view name) const;

  std::map<std::string, Entry, std::less<>> entries_;
};

struct Command {
  std::string name = {};
  std::string summary = {};                ///< one line
  std::string help = {};                   ///< paragraphs separated by empty lines; see `paragraphs`
  std::vector<std::string> examples = {};  ///< shell commands; script lines where the command is for scripts only
  std::vector<Parameter> parameters = {};
  std::function<void(Session&, const Arguments&)> action = {};
  /// Throws `Error` for arguments that do not fit each other. A script is checked before its first command runs.
  std::function<void(const Arguments&)> check = {};
  bool scriptOnly = false;
  bool commandLineOnly = false;
  bool takesVariables = false;    ///< positional `name=value` words are values, not options
  bool definesVariables = false;  ///< the parameter `assignments` defines variables for the rest of the script
  bool includesScript = false;    ///< the command is replaced by the lines of the script that `script` names
};

class Registry {
 public:
  /// Adds the command, and to it the parameter `json`, which every command has. Throws std::logic_error where a command
  /// of that name exists.
  void add(Command command);
  /// Does the same with a command that the command line does not have.
  void addForScripts(Command command);
  const std::vector<Command>& commands() const { return commands_; }
  /// Throws `Error` with the nearest known name where there is no such command.
  const Command& command(std::string_view name) const;

 private:
  std::vector<Command> commands_;
};

/// Returns the parameter that has this name or synonym, or null.
const Parameter* findParameter(const Command& command, std::string_view name);

/// Joins the lines of each paragraph of a text, in which empty lines separate the paragraphs.
std::string paragraphs(std::string_view text);

/// One word of a call with its position.
struct Word {
  std::string text = {};
  int column = 0;  ///< column of the first character, from 1
  /// Index of the `=` that makes the word `name=value` in a script; npos where there is none or it was quoted.
  std::size_t equals = std::string::npos;
};

enum class Origin : std::uint8_t { commandLine, script };

/// Thrown for a word of a call that is not accepted.
class ArgumentError : public Error {
 public:
  ArgumentError(const std::string& message, std::size_t word) : Error(message), word_(word) {}
  /// Index of the word, or the number of words where one is missing.
  std::size_t word() const { return word_; }

 private:
  std::size_t word_;
};

/// Parses and checks the words that follow a verb: `--name value`, `--name=value`, `-o value`, positional values, and
/// `name=value` in a script. Throws `ArgumentError`.
Arguments parseArguments(const Command& command, std::span<const Word> words, Origin origin);

/// Runs the command. Throws `Error` before any work where an output is also one of the inputs.
void perform(const Command& command, Session& session, const Arguments& arguments);

/// Describes the accepted values of a parameter, e.g. "a whole number from 1 to 30".
std::string expectedValue(const Parameter& parameter);

/// Parses `text` as one finite number; nothing where any of it is left over.
std::optional<double> parseNumber(std::string_view text);

}  // namespace hpsdf::app
