// The layout is described in docs/file-format.md.
#include "hpsdf/field_file.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/error.h"
#include "util/checked_file.h"

namespace hpsdf {
namespace {

// The carriage return, line feed and end-of-file mark show a transfer that took the file for text, like PNG's.
constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', '\r', '\n', '\x1a'};
// Version 1 has no steps; 2 neither continuity, bounds, maximum error nor criteria; 3 no inside test.
constexpr std::uint32_t kVersion = 4;
constexpr std::uint64_t kUnknownSteps = ~std::uint64_t{0};

constexpr detail::FileKind kKind{"field file", "a .hpsdf file", "build or copy it again"};

struct Sizes {
  std::uint64_t nodes = 0;
  std::uint64_t coefficients = 0;
  std::uint32_t coefficientBytes = 8;
  std::uint64_t bounds = 0;
};

void stepsItem(detail::CheckedWriter& writer, const std::optional<std::uint64_t>& steps) {
  writer.item(steps.value_or(kUnknownSteps));
}

void stepsItem(detail::CheckedReader& reader, std::optional<std::uint64_t>& steps) {
  std::uint64_t stored = 0;
  reader.item(stored);
  if (stored != kUnknownSteps) steps = stored;
}

/// A setting is stored as f64 if it is a number, u32 if whole, u8 if it is a word's index or a flag.
double storedNumber(const BuildSetting& setting, const BuildOptions& settings) {
  const std::vector<double> numbers = setting.get(settings);
  return numbers.empty() ? 0 : numbers[0];
}

void settingItem(detail::CheckedWriter& writer, const BuildSetting& setting, const BuildOptions& settings) {
  const double number = storedNumber(setting, settings);
  if (setting.type == BuildSetting::Type::number)
    writer.item(number);
  else if (setting.type == BuildSetting::Type::wholeNumber)
    writer.item(static_cast<std::uint32_t>(static_cast<std::int64_t>(number)));
  else
    writer.item(static_cast<std::uint8_t>(number));
}

void settingItem(detail::CheckedReader& reader, const BuildSetting& setting, BuildOptions& settings) {
  double number = 0;
  if (setting.type == BuildSetting::Type::number) {
    reader.item(number);
  } else if (setting.type == BuildSetting::Type::wholeNumber) {
    std::uint32_t whole = 0;
    reader.item(whole);
    number = whole;
  } else {
    std::uint8_t index = 0;
    reader.item(index);
    if (index >= std::max<std::size_t>(setting.words.size(), 2))
      reader.damaged("its " + std::string(setting.name) + " is unknown");
    number = index;
  }
  if (number == 0 && setting.get(BuildOptions{}).empty())
    setting.set(settings, {});
  else
    setting.set(settings, std::array{number});
}

/// The settings whose positions in the file run from `first` to `last`.
template <typename Stream, typename Settings>
void settingItems(Stream& stream, Settings& settings, int first, int last) {
  for (int position = first; position <= last; ++position)
    settingItem(stream, *std::ranges::find(buildSettings(), position, &BuildSetting::storedAt), settings);
}

/// Every scalar of the file after magic and version, in order. `Data` is const when writing.
template <typename Stream, typename Data, typename SizesRef>
void header(Stream& stream, Data& data, SizesRef& sizes, std::uint32_t version) {
  stream.item(sizes.coefficientBytes);
  stream.item(sizes.nodes);
  stream.item(sizes.coefficients);
  for (auto& cells : data.grid) stream.item(cells);
  const auto corner = [&](auto& vector) {
    for (int axis = 0; axis < 3; ++axis) stream.item(vector[axis]);
  };
  corner(data.domain.min());
  corner(data.domain.max());
  auto& m = data.metadata;
  stream.text(m.source.name);
  stream.item(m.source.fingerprint);
  stream.item(m.source.vertices);
  stream.item(m.source.faces);
  corner(m.source.box.min());
  corner(m.source.box.max());
  corner(m.source.normalization.center);
  stream.item(m.source.normalization.scale);
  settingItems(stream, m.settings, 1, 1);
  stream.item(m.totalError);
  stream.item(m.referenceLength);
  settingItems(stream, m.settings, 2, 7);
  stream.item(m.exactEvaluations);
  stream.item(m.roundingRms);
  if (version >= 2) stepsItem(stream, m.steps);
  if (version < 3) return;
  settingItems(stream, m.settings, 8, 11);
  stream.item(m.measuredError);
  settingItems(stream, m.settings, 12, 13);
  stream.item(data.blend);
  stream.item(sizes.bounds);
  if (version < 4) return;
  stream.item(m.source.insideTest);
  stream.item(m.source.thickness);
}

}  // namespace

void save(const Field& field, const std::filesystem::path& file) {
  const FieldData& data = field.data();
  detail::CheckedWriter writer(file);
  for (const char c : kMagic) writer.item(c);
  writer.item(kVersion);
  std::visit(
      [&](const auto& coefficients) {
        const Sizes sizes{data.nodes.size(), coefficients.size(), sizeof(coefficients[0]), data.bounds.size()};
        header(writer, data, sizes, kVersion);
        writer.array(std::span(data.nodes));
        writer.array(std::span(coefficients));
      },
      data.coefficients);
  writer.array(std::span(data.bounds));
  writer.finish();
}

Field load(const std::filesystem::path& file) {
  detail::CheckedReader reader(file, kKind);
  std::array<char, 8> magic{};
  try {
    for (char& c : magic) reader.item(c);
  } catch (const Error&) {
    reader.refuse("is not a .hpsdf file (too short); build one with `hpsdf build`");
  }
  if (magic != kMagic) reader.refuse("is not a .hpsdf file; build one with `hpsdf build`");
  std::uint32_t version = 0;
  reader.item(version);
  if (version == 0 || version > kVersion)
    reader.refuse("has file format version " + std::to_string(version) + ", this program reads 1 to " +
                  std::to_string(kVersion) + "; build it again");
  FieldData data;
  Sizes sizes;
  header(reader, data, sizes, version);
  if (sizes.coefficientBytes != 4 && sizes.coefficientBytes != 8)
    reader.damaged("its coefficients have an unknown type");
  Source& source = data.metadata.source;
  if (source.insideTest > InsideTest::outerHull) reader.damaged("its inside test is unknown");
  if (version < 4 && source.faces > 0) source.insideTest = InsideTest::pseudonormal;  // the only one of these versions
  reader.array(data.nodes, sizes.nodes);
  if (sizes.coefficientBytes == 4)
    reader.array(data.coefficients.emplace<std::vector<float>>(), sizes.coefficients);
  else
    reader.array(data.coefficients.emplace<std::vector<double>>(), sizes.coefficients);
  reader.array(data.bounds, sizes.bounds);
  reader.finish();
  try {
    return Field(std::move(data));
  } catch (const Error& error) {
    reader.refuse(error.what());
  }
}

}  // namespace hpsdf
