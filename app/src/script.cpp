#include "script.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "failed.h"
#include "hpsdf/error.h"
#include "hpsdf/nearest_name.h"
#include "session.h"

namespace hpsdf::app {
namespace {

bool isLower(char c) { return c >= 'a' && c <= 'z'; }
bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isLetter(char c) { return isLower(c) || (c >= 'A' && c <= 'Z') || c == '_'; }

/// Of a variable: letters, digits and _, not first a digit.
bool isIdentifier(std::string_view name) {
  return !name.empty() && isLetter(name[0]) &&
         std::ranges::all_of(name, [](char c) { return isLetter(c) || isDigit(c); });
}

/// Where a `=` ends a name of an option or a variable; npos for any other word, such as builtin:torus,major=0.7.
std::size_t equalsAfterName(std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos || equals == 0) return std::string_view::npos;
  const auto name = word.substr(0, equals);
  const bool plain =
      isLetter(name[0]) && std::ranges::all_of(name, [](char c) { return isLetter(c) || isDigit(c) || c == '-'; });
  return plain ? equals : std::string_view::npos;
}

struct Statement {
  int line;
  std::vector<Word> words;
};

/// Splits a script into statements and words.
class Scanner {
 public:
  Scanner(std::string_view name, std::string_view text) : name_(name), text_(text) {}

  /// The next statement that has words; an empty one at the end of the text.
  Statement next(const Variables& variables) {
    Statement statement{line_, {}};
    while (position_ < text_.size()) {
      const char c = text_[position_];
      if (c == '\n' || c == ';') {
        advance();
        if (!statement.words.empty()) return statement;
        statement.line = line_;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        advance();
      } else if (c == '#') {
        while (position_ < text_.size() && text_[position_] != '\n') advance();
      } else {
        statement.line = statement.words.empty() ? line_ : statement.line;
        statement.words.push_back(word(variables));
      }
    }
    return statement;
  }

  [[noreturn]] void fail(int line, int column, const std::string& message) const {
    throw Error(fmt::format("{}:{}:{}: {}", name_, line, column, message));
  }

 private:
  void advance() {
    if (text_[position_] == '\n') {
      ++line_;
      column_ = 1;
    } else if ((static_cast<unsigned char>(text_[position_]) & 0xc0) != 0x80) {  // a UTF-8 character is one column
      ++column_;
    }
    ++position_;
  }

  bool atWordEnd() const {
    constexpr std::string_view kEnds = " \t\r\n;";
    return position_ == text_.size() || kEnds.find(text_[position_]) != std::string_view::npos;
  }

  Word word(const Variables& variables) {
    Word word{.column = column_};
    std::size_t literal = std::string::npos;  // length of the part before the first quote or variable
    while (!atWordEnd()) {
      const char c = text_[position_];
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
    while (position_ < text_.size() && text_[position_] != '\n') {
      const char c = text_[position_];
      const char after = position_ + 1 < text_.size() ? text_[position_ + 1] : '\0';
      if (c == '"') return advance();
      if (c == '$') {
        variable(out, variables);
        continue;
      }
      if (c == '\\' && (after == '"' || after == '\\')) advance();
      out += text_[position_];
      advance();
    }
    fail(line, column, "this quote is not closed on its line; expected another \"");
  }

  void variable(std::string& out, const Variables& variables) {
    const int column = column_;
    advance();
    if (position_ < text_.size() && text_[position_] == '$') {
      out += '$';
      return advance();
    }
    const bool braced = position_ < text_.size() && text_[position_] == '{';
    if (braced) advance();
    std::string name;
    while (position_ < text_.size() && (isLetter(text_[position_]) || isDigit(text_[position_]))) {
      name += text_[position_];
      advance();
    }
    if (braced && (position_ == text_.size() || text_[position_] != '}'))
      fail(line_, column, "expected } after ${" + name);
    if (braced) advance();
    if (!isIdentifier(name)) fail(line_, column, "expected a variable's name after $; a plain dollar sign is $$");
    const auto found = variables.find(name);
    if (found == variables.end()) fail(line_, column, unknownVariable(name, variables));
    out += found->second;
  }

  static std::string unknownVariable(const std::string& name, const Variables& variables) {
    std::vector<std::string> known;
    for (const auto& [other, value] : variables) known.push_back(other);
    const std::string near = nearestName(name, known);
    return fmt::format("unknown variable ${}; {}", name,
                       near.empty() ? fmt::format("give {}=VALUE after the script, or 'set {}=VALUE'", name, name)
                                    : fmt::format("did you mean ${}?", near));
  }

  std::string_view name_;
  std::string_view text_;
  std::size_t position_ = 0;
  int line_ = 1;
  int column_ = 1;
};

}  // namespace

std::string readTextFile(const std::string& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw Error(file + ": is a folder; give a file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(file + (std::filesystem::exists(file, ignored) ? ": cannot be read; check its permissions"
                                                               : ": no such file; check the name"));
  std::stringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

bool isVariableAssignment(std::string_view word) {
  const std::size_t equals = word.find('=');
  return equals != std::string_view::npos && isIdentifier(word.substr(0, equals));
}

Variables parseVariables(const std::vector<std::string>& words) {
  Variables variables;
  for (const std::string& word : words) {
    if (!isVariableAssignment(word)) throw Error(fmt::format("expected name=value, found '{}'", word));
    variables[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
  }
  return variables;
}

std::vector<Call> parseScript(const Registry& registry, std::string_view name, std::string_view text,
                              Variables variables) {
  std::vector<Call> calls;
  Scanner scanner(name, text);
  for (;;) {
    const Statement statement = scanner.next(variables);
    if (statement.words.empty()) return calls;
    const Word& verb = statement.words.front();
    const auto rest = std::span(statement.words).subspan(1);
    try {
      const Command& command = registry.command(verb.text);
      Arguments arguments = parseArguments(command, rest, Origin::script);
      if (command.definesVariables)
        for (auto& [key, value] : parseVariables(arguments.texts("assignments"))) variables[key] = value;
      calls.push_back(
          {&command, std::move(arguments), fmt::format("{}:{}:{}", name, statement.line, verb.column), statement.line});
    } catch (const ArgumentError& error) {
      scanner.fail(statement.line, error.word() < rest.size() ? rest[error.word()].column : verb.column, error.what());
    } catch (const Error& error) {
      scanner.fail(statement.line, verb.column, error.what());
    }
  }
}

void runScript(Session& session, std::span<const Call> calls) {
  for (const Call& call : calls) {
    try {
      perform(*call.command, session, call.arguments);
    } catch (const Failed& error) {
      throw Failed(call.where + ": " + error.what());
    } catch (const Error& error) {
      throw Error(call.where + ": " + error.what());
    }
  }
}

}  // namespace hpsdf::app
