#pragma once
// Every verb of the program, once: its parameters with types, ranges, defaults and help. Scripts, the command line,
// the help text and docs/commands.md all come from here.

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

namespace hpsdf::app {

class Session;

enum class ParameterType : std::uint8_t {
  text,
  path,        ///< of a file to read
  outputPath,  ///< of a file or folder to write
  number,
  wholeNumber,
  numbers,  ///< separated by commas, as many as one of `counts`
  choice,
  flag,
  size,  ///< WIDTHxHEIGHT
};

/// When a parameter must be given. A script works on the current field, the command line starts with none.
enum class Need : std::uint8_t { optional, onCommandLine, always };

struct Parameter {
  std::string name = {};
  ParameterType type = ParameterType::text;
  std::string help = {};
  std::string defaultText = {};  ///< as one would write it; "" where there is none
  std::string valueName = {};    ///< in the help, e.g. "FILE"; "" for the type's own
  std::string unit = {};
  std::optional<double> minimum = {};
  std::optional<double> maximum = {};
  bool minimumExcluded = false;
  bool whole = false;                     ///< of `numbers`
  std::vector<std::string> choices = {};  ///< of `choice`; words that `numbers` takes instead of numbers
  std::vector<std::size_t> counts = {};   ///< of `numbers`
  char alias = 0;                         ///< o for -o
  bool positional = false;
  bool repeatable = false;
  Need need = Need::optional;
};

/// The validated values of one call.
class Arguments {
 public:
  /// Whether it was written down, rather than left to its default.
  bool given(std::string_view name) const;
  /// Given, or has a default.
  bool has(std::string_view name) const;

  std::string text(std::string_view name) const;
  /// `fallback` where it has no value.
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
  std::vector<std::string> examples = {};  ///< as typed in a shell; of script verbs, script lines
  std::vector<Parameter> parameters = {};
  std::function<void(Session&, const Arguments&)> action = {};
  /// What of the arguments the parameters' types cannot tell: throws `Error`. Of a script, before its first line runs.
  std::function<void(const Arguments&)> check = {};
  bool scriptOnly = false;
  bool commandLineOnly = false;
  bool takesVariables = false;    ///< positional `name=value` words are its own, not options
  bool definesVariables = false;  ///< and define variables for the rest of the script (`assignments`)
  bool includesScript = false;    ///< the lines of another (`script`) follow in its place
};

class Registry {
 public:
  /// Adds the parameter `json` that every command has. Throws std::logic_error for a second command of that name.
  void add(Command command);
  const std::vector<Command>& commands() const { return commands_; }
  /// Throws `Error` naming the nearest known command.
  const Command& command(std::string_view name) const;

 private:
  std::vector<Command> commands_;
};

const Parameter* findParameter(const Command& command, std::string_view name);

/// One word of a call, and where it stands.
struct Word {
  std::string text = {};
  int column = 0;  ///< 1-based
  /// Position of a `=` that makes the word `name=value` in a script; npos when there is none or it was quoted.
  std::size_t equals = std::string::npos;
};

enum class Origin : std::uint8_t { commandLine, script };

/// A word that does not fit.
class ArgumentError : public Error {
 public:
  ArgumentError(const std::string& message, std::size_t word) : Error(message), word_(word) {}
  /// Its index, or the number of words when something is missing.
  std::size_t word() const { return word_; }

 private:
  std::size_t word_;
};

/// Types and checks the words that follow a verb: `--name value`, `--name=value`, `-o value`, positional values, and,
/// in a script, `name=value`. Throws `ArgumentError`.
Arguments parseArguments(const Command& command, std::span<const Word> words, Origin origin);

/// Runs the command. Throws `Error` for an output that is one of its inputs, before anything is done.
void perform(const Command& command, Session& session, const Arguments& arguments);

/// What a parameter takes, e.g. "a whole number from 1 to 30".
std::string expectedValue(const Parameter& parameter);

/// The finite number that is all of `text`.
std::optional<double> parseNumber(std::string_view text);

}  // namespace hpsdf::app
