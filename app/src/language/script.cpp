#include "language/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "files/text_file.h"
#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kDeepestInclude = 16;  // deepest nesting of `include`, the same as for `run`
// Limits on the size of a script. Without limits, nested variables and files that include another file twice would let
// a few lines of script require any amount of memory.
constexpr std::size_t kMostCalls = 100'000;
constexpr std::size_t kMostVariableBytes = std::size_t{1} << 24;  // total length of all substituted values of $name

/// True if `name` is a valid name of a variable: letters, digits and _, with no digit at the start.
bool isIdentifier(std::string_view name) {
  return !name.empty() && isLetter(name[0]) &&
         std::ranges::all_of(name, [](char c) { return isLetter(c) || isDigit(c); });
}

/// Returns the index of the `=` that follows the name of an option or variable at the start of the word.
/// Returns npos for any other word, such as builtin:torus,major=0.7.
std::size_t equalsAfterName(std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos || equals == 0) return std::string_view::npos;
  const auto name = word.substr(0, equals);
  const bool isName =
      isLetter(name[0]) && std::ranges::all_of(name, [](char c) { return isLetter(c) || isDigit(c) || c == '-'; });
  return isName ? equals : std::string_view::npos;
}

struct Statement {
  int line;
  std::vector<Word> words;
};

/// Splits the text of a script into statements and the statements into words.
class Scanner {
 public:
  /// Makes a scanner for the script `text`. The scanner appends `includedFrom` to every error message, and adds the
  /// length of each variable value that it substitutes to `variableBytes`.
  Scanner(std::string_view name, std::string_view text, std::string_view includedFrom, std::size_t& variableBytes)
      : name_(name), text_(text), includedFrom_(includedFrom), variableBytes_(variableBytes) {}

  /// Returns the next statement that is not empty. Returns an empty statement at the end of the text.
  Statement statement(const Variables& variables) {
    Statement read{line_, {}};
    while (!atEnd()) {
      const char c = next();
      if (c == '\n' || c == ';') {
        advance();
        if (!read.words.empty()) return read;
        read.line = line_;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        advance();
      } else if (c == '#') {
        while (!atEnd() && next() != '\n') advance();
      } else {
        read.line = read.words.empty() ? line_ : read.line;
        read.words.push_back(word(variables));
      }
    }
    return read;
  }

  [[noreturn]] void fail(int line, int column, const std::string& message, ErrorKind kind = ErrorKind::general) const {
    throw Error(kind, fmt::format("{}:{}:{}", name_, line, column), message + std::string(includedFrom_));
  }

 private:
  bool atEnd() const { return position_ == text_.size(); }
  /// Returns the next character to be read, without advancing. Returns a zero byte at the end of the text.
  char next() const { return atEnd() ? '\0' : text_[position_]; }

  void advance() {
    if (next() == '\n') {
      ++line_;
      column_ = 1;
    } else if ((static_cast<unsigned char>(next()) & 0xc0) != 0x80) {  // UTF-8 continuation bytes have no column
      ++column_;
    }
    ++position_;
  }

  bool atWordEnd() const {
    constexpr std::string_view kEnds = " \t\r\n;";
    return atEnd() || kEnds.find(next()) != std::string_view::npos;
  }

  Word word(const Variables& variables) {
    Word word{.column = column_};
    std::size_t literal = std::string::npos;  // length of the text before the first quote or variable
    while (!atWordEnd()) {
      const char c = next();
      if (c == '"' || c == '$') literal = std::min(literal, word.text.size());
      if (c == '"') {
        quoted(word.text, variables);
      } else if (c == '$') {
        variable(word.text, variables);
      } else {
        word.text += c;
        advance();
      }
    }
    word.equals = equalsAfterName(std::string_view(word.text).substr(0, literal));
    return word;
  }

  void quoted(std::string& out, const Variables& variables) {
    const int line = line_;
    const int column = column_;
    advance();
    while (!atEnd() && next() != '\n') {
      const char c = next();
      const char after = position_ + 1 < text_.size() ? text_[position_ + 1] : '\0';
      if (c == '"') return advance();
      if (c == '$') {
        variable(out, variables);
        continue;
      }
      if (c == '\\' && (after == '"' || after == '\\')) advance();
      out += next();
      advance();
    }
    fail(line, column, "this quote is not closed on its line; expected another \"");
  }

  void variable(std::string& out, const Variables& variables) {
    const int column = column_;
    advance();
    if (next() == '$') {
      out += '$';
      return advance();
    }
    const bool braced = next() == '{';
    if (braced) advance();
    std::string name;
    for (; isLetter(next()) || isDigit(next()); advance()) name += next();
    if (braced && next() != '}') fail(line_, column, "expected } after ${" + name);
    if (braced) advance();
    if (!isIdentifier(name)) fail(line_, column, "expected a variable's name after $; write $$ for a dollar sign");
    const auto found = variables.find(name);
    if (found == variables.end()) fail(line_, column, unknownVariable(name, variables));
    variableBytes_ += found->second.size();
    if (variableBytes_ > kMostVariableBytes)
      fail(line_, column,
           fmt::format("the script's variables expand to more than {} characters; use fewer", kMostVariableBytes));
    out += found->second;
  }

  static std::string unknownVariable(const std::string& name, const Variables& variables) {
    std::vector<std::string> known;
    for (const auto& [other, value] : variables) known.push_back(other);
    const std::string remedy = fmt::format("give {}=VALUE after the script, or 'set {}=VALUE'", name, name);
    return fmt::format("unknown variable ${}; {}", name, didYouMean(name, known, remedy, "$"));
  }

  std::string_view name_;
  std::string_view text_;
  std::string_view includedFrom_;
  std::size_t& variableBytes_;
  std::size_t position_ = 0;
  int line_ = 1;
  int column_ = 1;
};

/// Reads a script. The lines of an included script take the place of the command `include`.
class ScriptReader {
 public:
  ScriptReader(const Registry& registry, Variables variables) : registry_(registry), variables_(std::move(variables)) {}

  std::vector<Call> read(std::string_view name, std::string_view text) {
    add(name, text);
    return std::move(calls_);
  }

 private:
  /// A script that is being read. While it includes another script, `where` and `line` hold the position of its
  /// `include` command.
  struct Open {
    std::string name;
    std::string where = {};
    int line = 0;
  };

  void add(std::string_view name, std::string_view text) {
    const std::string includedFrom = includedFromText();
    open_.push_back({std::string(name)});
    Scanner scanner(name, text, includedFrom, variableBytes_);
    for (;;) {
      const Statement statement = scanner.statement(variables_);
      if (statement.words.empty()) break;
      const std::optional<Included> included = addCall(scanner, statement, includedFrom);
      if (included) add(included->name, included->text);
    }
    open_.pop_back();
  }

  struct Included {
    std::string name, text;
  };

  /// Checks a statement and appends its call to the list of calls. If the statement includes another script,
  /// returns that script, and otherwise std::nullopt.
  std::optional<Included> addCall(const Scanner& scanner, const Statement& statement, const std::string& includedFrom) {
    const Word& verb = statement.words.front();
    const auto rest = std::span(statement.words).subspan(1);
    std::optional<Included> included;
    try {
      if (calls_.size() == kMostCalls)
        throw Error(fmt::format("more than {} commands, counting those of included scripts; use fewer", kMostCalls));
      const Command& command = registry_.command(verb.text);
      if (command.commandLineOnly)
        throw Error(fmt::format("'{}' is a command of the command line: hpsdf {} …", verb.text, verb.text));
      Arguments arguments = parseArguments(command, rest, Origin::script);
      if (command.definesVariables)
        for (auto& [key, value] : parseVariables(arguments.texts("assignments"))) variables_[key] = value;
      open_.back().where = fmt::format("{}:{}:{}", open_.back().name, statement.line, verb.column);
      open_.back().line = statement.line;
      if (command.includesScript) included = readIncluded(arguments.text("script"));
      calls_.push_back({&command, std::move(arguments), open_.back().where, includedFrom, open_.front().line});
    } catch (const ArgumentError& error) {
      scanner.fail(statement.line, error.word() < rest.size() ? rest[error.word()].column : verb.column, error.what(),
                   ErrorKind::option);
    } catch (const Error& error) {
      scanner.fail(statement.line, verb.column, error.what(), error.kind());
    }
    return included;
  }

  /// Reads an included script. Relative file names are searched in the folder of the including script.
  Included readIncluded(const std::string& file) const {
    const auto path = (std::filesystem::path(open_.back().name).parent_path() / file).lexically_normal();
    const auto isThat = [&](const Open& other) {
      std::error_code missing;
      return std::filesystem::equivalent(path, other.name, missing);
    };
    if (std::ranges::any_of(open_, isThat))
      throw Error(fmt::format("{}: includes itself, directly or by others; remove one of the includes", path.string()));
    if (std::error_code missing; std::filesystem::exists(path, missing) &&
                                 !std::filesystem::is_regular_file(path, missing) &&
                                 !std::filesystem::is_directory(path, missing))
      throw Error(path.string() + ": is not a regular file; include a script");  // reading a device might never end
    if (open_.size() > kDeepestInclude)
      throw Error(fmt::format("{}: more than {} scripts include each other; join some of them", path.string(),
                              kDeepestInclude));
    return {path.string(), readTextFile(path.string())};
  }

  std::string includedFromText() const {
    if (open_.empty()) return {};
    std::string text = " (included from ";
    for (auto from = open_.rbegin(); from != open_.rend(); ++from)
      text += (from == open_.rbegin() ? "" : ", ") + from->where;
    return text + ")";
  }

  const Registry& registry_;
  Variables variables_;
  std::vector<Open> open_;  // nested scripts that are being read, outermost first
  std::vector<Call> calls_;
  std::size_t variableBytes_ = 0;
};

}  // namespace

Variables parseVariables(const std::vector<std::string>& words) {
  Variables variables;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || !isIdentifier(std::string_view(word).substr(0, equals)))
      throw Error(fmt::format("expected name=value, found '{}'", word));
    variables[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return variables;
}

std::vector<Call> parseScript(const Registry& registry, std::string_view name, std::string_view text,
                              Variables variables) {
  return ScriptReader(registry, std::move(variables)).read(name, text);
}

}  // namespace hpsdf::app
