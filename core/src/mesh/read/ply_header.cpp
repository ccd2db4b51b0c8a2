#include "mesh/read/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypeNames = {{{"char", PlyType::int8},
                                                                              {"uchar", PlyType::uint8},
                                                                              {"short", PlyType::int16},
                                                                              {"ushort", PlyType::uint16},
                                                                              {"int", PlyType::int32},
                                                                              {"uint", PlyType::uint32},
                                                                              {"float", PlyType::float32},
                                                                              {"double", PlyType::float64},
                                                                              {"int8", PlyType::int8},
                                                                              {"uint8", PlyType::uint8},
                                                                              {"int16", PlyType::int16},
                                                                              {"uint16", PlyType::uint16},
                                                                              {"int32", PlyType::int32},
                                                                              {"uint32", PlyType::uint32},
                                                                              {"float32", PlyType::float32},
                                                                              {"float64", PlyType::float64}}};

/// Reads the lines of a header one by one.
class HeaderLines {
 public:
  explicit HeaderLines(Input& input) : input_(input) {}

  /// Returns the words of the next line. Where the first line ends with \r alone, so do all others, and a line feed
  /// behind `end_header\r` belongs to the binary data.
  std::vector<std::string> next() {
    constexpr std::size_t kLongest = 16384;
    static_assert(kLongest < Input::kLongestPiece);
    input_.ensure(kLongest);
    const std::string_view rest = input_.rest();
    const std::size_t end = rest.find_first_of("\r\n");
    if (end == rest.npos) input_.refuse("its header, or a line of it, does not end; check or export the file again");
    ++number_;
    const bool isPair = rest.substr(end).starts_with("\r\n");
    if (number_ == 1) endsByReturn_ = rest[end] == '\r' && !isPair;
    const std::vector<std::string> words = wordsOf(rest.substr(0, end));
    input_.skip(end + (isPair && !endsByReturn_ ? 2 : 1));
    return words;
  }

  std::uint64_t number() const { return number_; }

  [[noreturn]] void refuse(const std::string& problem) const {
    input_.refuse("line " + std::to_string(number_) + ": " + problem + "; check or export the file again");
  }

 private:
  static std::vector<std::string> wordsOf(std::string_view line) {
    constexpr std::string_view kBlanks = " \t\v\f";
    std::vector<std::string> words;
    for (std::size_t at = 0; (at = line.find_first_not_of(kBlanks, at)) != line.npos;) {
      const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
      words.emplace_back(line.substr(at, end - at));
      at = end;
    }
    return words;
  }

  Input& input_;
  bool endsByReturn_ = false;  ///< lines end with \r alone
  std::uint64_t number_ = 0;
};

PlyType typeOf(const std::string& name, const HeaderLines& lines) {
  const auto found =
      std::ranges::find(kTypeNames, std::string_view(name), &std::pair<std::string_view, PlyType>::first);
  if (found == kTypeNames.end()) lines.refuse("unknown type '" + wordText(name) + "'");
  return found->second;
}

PlyHeader::Format formatOf(const std::vector<std::string>& words, const HeaderLines& lines) {
  if (words.size() == 3 && words[2] == "1.0") {
    if (words[1] == "ascii") return PlyHeader::Format::ascii;
    if (words[1] == "binary_little_endian") return PlyHeader::Format::littleEndian;
    if (words[1] == "binary_big_endian") return PlyHeader::Format::bigEndian;
  }
  lines.refuse("expected 'format', one of ascii, binary_little_endian and binary_big_endian, and '1.0'");
}

PlyElement elementOf(const std::vector<std::string>& words, const HeaderLines& lines) {
  if (words.size() != 3) lines.refuse("expected 'element', a name and a number");
  PlyElement element{words[1]};
  const std::string& number = words[2];
  const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), element.count);
  if (error != std::errc() || stop != number.data() + number.size())
    lines.refuse("'" + wordText(number) + "' is no number of elements");
  return element;
}

PlyProperty propertyOf(const std::vector<std::string>& words, const HeaderLines& lines) {
  if (words.size() == 3) return {words[2], typeOf(words[1], lines)};
  if (words.size() != 5 || words[1] != "list")
    lines.refuse("expected 'property', a type and a name, or 'property list', two types and a name");
  const PlyType count = typeOf(words[2], lines);
  if (count == PlyType::float32 || count == PlyType::float64) lines.refuse("the length of a list is no whole number");
  return {words[4], typeOf(words[3], lines), count};
}

}  // namespace

std::size_t sizeOf(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[std::size_t(type)];
}

bool PlyElement::hasList() const {
  return std::ranges::any_of(properties, [](const PlyProperty& property) { return property.count.has_value(); });
}

std::size_t PlyElement::leastBytes() const {
  std::size_t bytes = 0;
  for (const PlyProperty& property : properties) bytes += sizeOf(property.count.value_or(property.type));
  return bytes;
}

std::optional<std::size_t> PlyElement::find(const std::string& property) const {
  const auto found = std::ranges::find(properties, property, &PlyProperty::name);
  if (found == properties.end()) return std::nullopt;
  return std::size_t(found - properties.begin());
}

PlyHeader readPlyHeader(Input& input) {
  HeaderLines lines(input);
  if (lines.next() != std::vector<std::string>{"ply"}) lines.refuse("a PLY file begins with the line 'ply'");
  PlyHeader header;
  bool hasFormat = false;
  for (;;) {
    const std::vector<std::string> words = lines.next();
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format") {
      header.format = formatOf(words, lines);
      hasFormat = true;
    } else if (words[0] == "element") {
      constexpr std::size_t kMostElements = 1000;
      if (header.elements.size() == kMostElements) lines.refuse("more than 1000 elements");
      PlyElement element = elementOf(words, lines);
      if (std::ranges::find(header.elements, element.name, &PlyElement::name) != header.elements.end())
        lines.refuse("a second element '" + wordText(element.name) + "'");
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property") {
      if (header.elements.empty()) lines.refuse("a property before the first element");
      header.elements.back().properties.push_back(propertyOf(words, lines));
    } else {
      lines.refuse("unknown word '" + wordText(words[0]) + "' in the header");
    }
  }
  if (!hasFormat) input.refuse("its header has no line 'format'; check or export the file again");
  header.lines = lines.number();
  return header;
}

}  // namespace hpsdf::mesh
