// The layout is described in docs/file-format.md.
#include "hpsdf/field_file.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "util/checked_file.h"

namespace hpsdf {
namespace {

// Like PNG's: a carriage return, a line feed and an end-of-file mark show a transfer that took it for text.
constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', '\r', '\n', '\x1a'};
constexpr std::uint32_t kVersion =
    4;  // 1 had no steps, 2 nothing of continuity, bounds and other ways to steer, 3 no sign
constexpr std::uint64_t kUnknownSteps = ~std::uint64_t{0};

constexpr FileKind kKind{"field file", "a .hpsdf file", "build or copy it again"};

struct Sizes {
  std::uint64_t nodes = 0;
  std::uint64_t coefficients = 0;
  std::uint32_t coefficientBytes = 8;
  std::uint64_t bounds = 0;
};

void stepsItem(CheckedWriter& writer, const std::optional<std::uint64_t>& steps) {
  writer.item(steps.value_or(kUnknownSteps));
}

void stepsItem(CheckedReader& reader, std::optional<std::uint64_t>& steps) {
  std::uint64_t stored = 0;
  reader.item(stored);
  if (stored != kUnknownSteps) steps = stored;
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
  stream.item(m.targetError);
  stream.item(m.totalError);
  stream.item(m.referenceLength);
  stream.item(m.nearness);
  stream.item(m.maxDegree);
  stream.item(m.maxDepth);
  stream.item(m.quadrature);
  stream.item(m.strategy);
  stream.item(m.band);
  stream.item(m.exactEvaluations);
  stream.item(m.roundingRms);
  if (version >= 2) stepsItem(stream, m.steps);
  if (version < 3) return;
  stream.item(m.estimator);
  stream.item(m.criterion);
  stream.item(m.nearnessKind);
  stream.item(m.maxError);
  stream.item(m.measuredError);
  stream.flag(m.enriched);
  stream.item(m.continuityWeight);
  stream.item(data.blend);
  stream.item(sizes.bounds);
  if (version < 4) return;
  stream.item(m.source.insideTest);
  stream.item(m.source.thickness);
}

}  // namespace

void save(const Field& field, const std::filesystem::path& file) {
  const FieldData& data = field.data();
  CheckedWriter writer(file);
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
  CheckedReader reader(file, kKind);
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
  const FieldMetadata& made = data.metadata;
  if (made.strategy > Strategy::h2 || made.estimator > Estimator::residual || made.criterion > Criterion::optimal ||
      made.nearnessKind > NearnessKind::exponential)
    reader.damaged("it was made by an unknown strategy, estimator, criterion or kind of nearness");
  if (made.source.insideTest > InsideTest::outerHull) reader.damaged("its sign is of an unknown kind");
  if (version < 4 && made.source.faces > 0)
    data.metadata.source.insideTest = InsideTest::pseudonormal;  // there was no other
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
