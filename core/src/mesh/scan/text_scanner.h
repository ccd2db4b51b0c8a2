#pragma once
// The words and numbers of a mesh file that is text.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "hpsdf/types.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads words, numbers and line ends from a text. Blanks are spaces, tabs and the like. Lines end with \n, \r or \r\n.
/// The text from the comment sign, if the format has one, to the end of the line is a comment, which counts as blank.
class TextScanner {
 public:
  /// Takes the format's comment sign, or '\0' if it has none, and the number of the line at which the text begins.
  /// `input` must outlive this object. A byte order mark at the beginning of a file is skipped.
  TextScanner(Input& input, char comment, std::uint64_t line = 1);

  /// Skips blanks, comments and line ends. Returns false if nothing is left then.
  bool toWord() {
    if (peek() == ' ') input_.skip(1);  // Mostly there is one blank.
    return !endsWord(peek()) || skipToWord();
  }

  /// Skips blanks and comments of this line. Returns true if the line or the file ends then. With the sign of a
  /// continuation before the line end, the next line belongs to this one (`joinLinesAt`).
  bool atLineEnd();

  /// From now on, a line whose last character is `sign` is continued by the next line.
  void joinLinesAt(char sign) {
    continuation_ = sign;
    endsWord_[static_cast<unsigned char>(sign)] = true;
  }

  /// Skips the rest of the line, and its end.
  void skipLine();

  /// Returns the word that begins here, up to the next blank, line end or comment, and skips it. It has at least one
  /// character unless the file ends, and is valid until the next call. Throws `Error` for a word that is longer than
  /// any in a mesh file.
  std::string_view word();

  /// Returns the number that begins here, and skips it. Throws `Error` if there is none, or if it is not finite or
  /// beyond the range of double. Numbers too small for double are 0 or the nearest denormal number.
  double number();

  /// Returns the three numbers that begin here or on later lines. `what` names them in errors.
  Vector3 vector(std::string_view what);

  /// Returns the whole number whose digits begin here, and skips it. `what` names it in errors. Throws `Error` if there
  /// is none, or if it does not fit 64 bits. The number ends before the first character that is not a digit.
  std::int64_t wholeNumberBefore(std::string_view what);

  /// Skips blanks and line ends, and returns the whole number that is the next word. Throws `Error` as
  /// `wholeNumberBefore` does, and if the word holds more than the number.
  std::int64_t wholeNumber(std::string_view what);

  /// Skips a character if it comes next.
  bool take(char c);

  /// Returns true if a character comes next.
  bool isNext(char c) { return peek() == c; }

  /// Returns true if a word or a number that ends here is whole: if a blank, a line end, a comment or the file's end
  /// comes next.
  bool endsWord() { return endsWord(peek()); }

  /// Returns the number of the line in which the scanner stands. The first line is line 1.
  std::uint64_t line() const { return line_; }

  Input& input() { return input_; }

  /// Throws `Error` (of the kind `file`) that names the file and the line, with the problem.
  [[noreturn]] void refuse(const std::string& problem) const;

 private:
  static constexpr std::size_t kLongestWord = 4096;
  static_assert(kLongestWord < Input::kLongestPiece);

  /// Returns the next character, or '\0' at the file's end. The whole of the word that begins there is in the window.
  char peek() {
    if (input_.rest().size() <= kLongestWord) input_.ensure(kLongestWord + 1);
    return input_.rest().empty() ? '\0' : input_.rest().front();
  }

  /// Returns true if a word cannot contain this character. `peek` gives '\0' at the file's end.
  bool endsWord(char c) const { return endsWord_[static_cast<unsigned char>(c)]; }
  bool skipToWord();
  bool skipBlanks();
  void skipLineEnd(char c);
  bool skipContinuation();
  [[noreturn]] void refuseWord(const std::string& expected);

  Input& input_;
  char comment_;
  char continuation_ = '\0';
  std::uint64_t line_;
  std::array<bool, 256> endsWord_ = {};  ///< for each character, whether a word ends before it
};

}  // namespace hpsdf::mesh
