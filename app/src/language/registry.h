#pragma once
// The registry describes every command of the program once: parameters with types, ranges, defaults and help texts.
// Scripts, the command line, the help and docs/commands.md are all derived from it.

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::app {

class Session;

enum class ParameterType : std::uint8_t {
  text,
  path,        ///< name of a file to read
  outputPath,  ///< name of a file or folder to write
  number,
  wholeNumber,
  numbers,  ///< numbers separated by commas; `Parameter::counts` lists how many are accepted
  choice,
  flag,
  size,  ///< WIDTHxHEIGHT
};

/// When a parameter is required. A script works on the current field, the command line starts without one.
enum class Need : std::uint8_t { optional, onCommandLine, always };

/// Where help texts show a parameter.
enum class Audience : std::uint8_t {
  common,    ///< in every help text
  advanced,  ///< only where all options are asked for: --help-all, docs/commands.md
};

struct Parameter {
  std::string name = {};
  ParameterType type = ParameterType::text;
  std::string help = {};
  std::string defaultText = {};  ///< the default as a user would write it; "" without a default
  std::string valueName = {};    ///< name of the value in help texts, e.g. "FILE"; "" for the name of its type
  std::string unit = {};
  std::optional<double> minimum = {};
  std::optional<double> maximum = {};
  bool minimumExcluded = false;
  bool whole = false;                     ///< `numbers` accepts whole numbers only
  std::vector<std::string> choices = {};  ///< values of a `choice`, or words that `numbers` accepts instead of numbers
  std::vector<std::size_t> counts = {};   ///< how many values `numbers` accepts
  char alias = 0;                         ///< one-letter spelling: o for -o
  bool positional = false;
  bool repeatable = false;
  Need need = Need::optional;
  std::string synonym = {};  ///< second accepted name, which help texts prefer; "" without one
  std::string group = {};    ///< heading above the parameter in help texts; "" for the general one
  Audience audience = Audience::common;
};

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
  std::string help = {};                   ///< paragraphs separated by empty lines
  std::vector<std::string> examples = {};  ///< shell commands; script lines where the command is for scripts only
  std::vector<Parameter> parameters = {};
  std::function<void(Session&, const Arguments&)> action = {};
  /// Throws `Error` for arguments that do not fit each other. A script is checked before its first command runs.
  std::function<void(const Arguments&)> check = {};
  bool scriptOnly = false;
  bool commandLineOnly = false;
  bool takesVariables = false;    ///< positional `name=value` words are values, not options
  bool definesVariables = false;  ///< the parameter `assignments` defines variables for the rest of the script
  bool includesScript = false;    ///< the lines of the script that the parameter `script` names replace the command
};

/// Group and audience of a parameter in help texts, for every command that has a parameter of this name.
struct ParameterPresentation {
  std::string_view name;
  std::string_view group;
  Audience audience = Audience::common;
  std::string_view synonym = {};
};

class Registry {
 public:
  /// Adds the command, and to it the parameter `json`, which every command has. Throws std::logic_error where a command
  /// of that name exists.
  void add(Command command);
  /// Applies the table to the parameters of all commands that have no group of their own.
  void present(std::span<const ParameterPresentation> table);
  const std::vector<Command>& commands() const { return commands_; }
  /// Throws `Error` with the nearest known name where there is no such command.
  const Command& command(std::string_view name) const;

 private:
  std::vector<Command> commands_;
};

/// Returns the parameter that has this name or synonym, or null.
const Parameter* findParameter(const Command& command, std::string_view name);

/// Concatenates tables of parameters.
std::vector<Parameter> joined(std::initializer_list<std::vector<Parameter>> tables);

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
