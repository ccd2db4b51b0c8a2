#pragma once
// The registry describes every command of the program once: its parameters with their types, ranges, defaults
// and help texts. The script language, the command line, the help and docs/commands.md are all derived from
// the registry.

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

namespace hpsdf::render {
struct Image;
}

namespace hpsdf::app {

class Session;

/// The validated argument values of one call of a command.
class Arguments {
 public:
  /// True if the caller gave the parameter explicitly. False if the parameter has its default or no value.
  bool given(std::string_view name) const;
  /// True if the parameter has a value, given explicitly or by default.
  bool has(std::string_view name) const;
  /// True if the caller gave the parameter by its name. False if it was given as a positional word, or not at all.
  bool named(std::string_view name) const;

  std::string text(std::string_view name) const;
  /// Returns the text of the parameter, or `fallback` if the parameter has no value.
  std::string textOr(std::string_view name, std::string fallback) const;
  std::vector<std::string> texts(std::string_view name) const;
  double number(std::string_view name) const;
  /// Returns true if the value is given as a percentage; `number` then returns it as a share: 0.0002 for 0.02%.
  bool isShare(std::string_view name) const;
  int whole(std::string_view name) const;
  std::vector<double> numbers(std::string_view name) const;
  bool flag(std::string_view name) const;
  std::array<int, 2> size(std::string_view name) const;

 private:
  friend class ArgumentReader;
  struct Value {
    std::string text = {};
    std::vector<double> numbers = {};
    bool isShare = false;  ///< the number was given as a percentage
  };
  struct Entry {
    bool given = false;
    bool named = false;
    std::vector<Value> values = {};
  };
  const Value& single(std::string_view name) const;
  const Entry& entry(std::string_view name) const;

  std::map<std::string, Entry, std::less<>> entries_;
};

struct Command {
  std::string name = {};
  std::string summary = {};                ///< description in one line
  std::string help = {};                   ///< paragraphs separated by empty lines; see `paragraphs`
  std::vector<std::string> examples = {};  ///< shell commands, or lines of a script if `scriptOnly` is true
  std::vector<Parameter> parameters = {};
  std::function<void(Session&, const Arguments&)> action = {};
  /// Draws the picture that `action` writes into the file `output`. It is set for commands whose result is one picture,
  /// and works without `output`.
  std::function<render::Image(Session&, const Arguments&)> draw = {};
  /// Returns the lines of a script by which the explorer shows what `action` has drawn last. It is set for commands
  /// that draw one view of the current field.
  std::function<std::string(Session&, const Arguments&)> view = {};
  /// Throws `Error` if the arguments contradict each other. All commands of a script are checked before its
  /// first command runs.
  std::function<void(const Arguments&)> check = {};
  /// Words that make the command draw without OpenGL, for messages. They may be empty if the command has the parameter
  /// `cpu` or does not draw.
  std::string drawsOnCpuBy = {};
  bool scriptOnly = false;
  bool commandLineOnly = false;
  bool takesVariables = false;    ///< words `name=value` are positional values, not options
  bool definesVariables = false;  ///< the parameter `assignments` defines variables for the rest of the script
  bool includesScript = false;    ///< the command is replaced by the lines of the script that `script` names
};

class Registry {
 public:
  /// Adds the command to the registry. The command also gets the parameter `json`, which every command has.
  /// Throws std::logic_error if the registry already has a command of this name.
  void add(Command command);
  /// Adds a command as `add` does, but the command is available only in scripts and not on the command line.
  void addForScripts(Command command);
  const std::vector<Command>& commands() const { return commands_; }
  /// Returns the command of this name. If there is none, throws `Error` with the most similar known name.
  const Command& command(std::string_view name) const;

 private:
  std::vector<Command> commands_;
};

/// Returns the parameter of the command that has this name or synonym. Returns nullptr if there is none.
const Parameter* findParameter(const Command& command, std::string_view name);

/// Joins the lines of each paragraph of a text into one line. Empty lines separate the paragraphs.
std::string paragraphs(std::string_view text);

/// One word of a command line or script line, with its column.
struct Word {
  std::string text = {};
  int column = 0;  ///< column of the first character, from 1
  /// Index of the `=` in a word of a script that has the form `name=value`. npos if the word has no `=` or if the `=`
  /// was quoted.
  std::size_t equals = std::string::npos;
};

enum class Origin : std::uint8_t { commandLine, script };

/// Thrown if a word of a call is not accepted or is missing.
class ArgumentError : public Error {
 public:
  ArgumentError(const std::string& message, std::size_t word) : Error(message), word_(word) {}
  /// Index of the word that is not accepted, or the number of words if a word is missing.
  std::size_t word() const { return word_; }

 private:
  std::size_t word_;
};

/// Parses and checks the words that follow the name of a command: `--name value`, `--name=value`, `-o value`,
/// positional values, and `name=value` in a script. Throws `ArgumentError` for words that the command does
/// not accept.
Arguments parseArguments(const Command& command, std::span<const Word> words, Origin origin);

/// Returns the output files and folders that the arguments name.
std::vector<std::string> outputFiles(const Command& command, const Arguments& arguments);

/// Runs the command. Throws `Error` before any work starts if an output file is also one of the input files. If OpenGL
/// cannot draw, throws an `Error` that says how the command draws without it.
void perform(const Command& command, Session& session, const Arguments& arguments);

/// Draws the picture of a command that has `Command::draw`. Throws as `perform` does.
render::Image drawn(const Command& command, Session& session, const Arguments& arguments);

/// Returns a description of the values that a parameter accepts, e.g. "a whole number from 1 to 30".
std::string expectedValue(const Parameter& parameter);

/// Parses the whole `text` as one finite number. Returns std::nullopt if `text` is anything else.
std::optional<double> parseNumber(std::string_view text);

}  // namespace hpsdf::app
