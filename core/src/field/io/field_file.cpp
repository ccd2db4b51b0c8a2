// Reads and writes field files. docs/file-format.md describes their layout.
#include "hpsdf/field_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "field/io/blocked_file.h"
#include "field/io/compressed_arrays.h"
#include "field/io/field_sizes.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/error.h"
#include "util/checked_file.h"

namespace hpsdf {

using namespace io;

namespace {

// First bytes of a field file. As in PNG files, the carriage return, line feed and end-of-file mark reveal that
// the file was transferred as text.
constexpr detail::Magic kFieldMagic = {'h', 'p', 's', 'd', 'f', '\r', '\n', '\x1a'};
// Version of the file format. Version 2 added the number of steps; version 3 continuity, bounds, maximum error
// and criteria; version 4 the inside test; version 8 exact leaves, the tolerance, the measurement and
// the settings that a replay of the construction needs; version 9 quantized coefficients; version 10 their shifts and
// wide leaves; version 11 the exactness of a combination, which other fields do not have; version 12 aligned arrays and
// checksums of blocks, so that files can be mapped. Compressed files have version 11 if they have an exactness, or else
// 10; all others have version 12. Versions 5 to 7 were never released.
constexpr std::uint32_t kBlockedVersion = 12, kExactnessVersion = 11, kShiftsVersion = 10, kQuantizedVersion = 9,
                        kExactLeavesVersion = 8;
constexpr std::uint64_t kUnknownSteps = ~std::uint64_t{0};
// Set in the version of a file whose arrays are compressed.
constexpr std::uint32_t kCompressed = std::uint32_t{1} << 31;

constexpr detail::FileKind kFieldFile{"field file", "a .hpsdf file", "build or copy it again"};

FieldSizes sizesOf(const FieldData& data) {
  FieldSizes sizes{.nodes = data.nodes.size(), .bounds = data.bounds.size()};
  std::visit(
      [&](const auto& c) {
        sizes.coefficients = arrayOf(c).size();
        sizes.coefficientBytes = sizeof(*arrayOf(c).data());
        if constexpr (requires { c.step; }) {
          sizes.step = c.step;
          sizes.meanBits = c.meanBits;
        }
      },
      data.coefficients);
  std::visit(
      [&](const auto& v) {
        sizes.vertices = v.size();
        sizes.vertexBytes = sizeof(v[0][0]);
      },
      data.exact.vertices);
  sizes.triangles = data.exact.triangles.size();
  sizes.lists = data.exact.lists.size();
  return sizes;
}

/// Writes or reads the number of refinement steps. `Steps` is const for writing.
template <typename Stream, typename Steps>
void stepsItem(Stream& stream, Steps& steps) {
  std::uint64_t stored = steps.value_or(kUnknownSteps);
  stream.item(stored);
  if constexpr (!std::is_const_v<Steps>) {
    if (stored != kUnknownSteps) steps = stored;
  }
}

template <typename Stored, typename Stream>
void wholeItem(Stream& stream, double& number) {
  auto stored = static_cast<Stored>(static_cast<std::int64_t>(number));
  stream.item(stored);
  number = static_cast<double>(stored);
}

/// Writes or reads one setting. A number is stored as f64, a whole number as u32 or, if it may be greater than that, as
/// u64, and the index of a word or a flag as u8. `Settings` is const for writing.
template <typename Stream, typename Settings>
void settingItem(Stream& stream, const BuildSetting& setting, Settings& settings) {
  const std::vector<double> numbers = setting.get(settings);
  double number = numbers.empty() ? 0 : numbers[0];
  if (setting.type == BuildSetting::Type::number) {
    stream.item(number);
  } else if (setting.type == BuildSetting::Type::wholeNumber && setting.maximum > 0xffffffffu) {
    wholeItem<std::uint64_t>(stream, number);
    stream.require(number <= setting.maximum, ("its " + std::string(setting.name) + " is out of range").c_str());
  } else if (setting.type == BuildSetting::Type::wholeNumber) {
    wholeItem<std::uint32_t>(stream, number);
  } else {
    wholeItem<std::uint8_t>(stream, number);
    const bool isKnown = number < std::max(double(setting.words.size()), 2.0);
    stream.require(isKnown, ("its " + std::string(setting.name) + " is unknown").c_str());
  }
  if constexpr (!std::is_const_v<Settings>) {
    if (number == 0 && setting.get(BuildOptions{}).empty()) {
      stream.require(!std::signbit(number), ("its " + std::string(setting.name) + " is -0").c_str());
      setting.set(settings, {});
    } else {
      setting.set(settings, std::array{number});
    }
  }
}

/// Writes or reads the settings whose positions in the file are `first` to `last`.
template <typename Stream, typename Settings>
void settingItems(Stream& stream, Settings& settings, int first, int last) {
  for (int position = first; position <= last; ++position)
    settingItem(stream, *std::ranges::find(buildSettings(), position, &BuildSetting::storedAt), settings);
}

/// Writes or reads the measurement of a field. If there is none, its number of points is 0, and nothing follows.
/// `Optional` is const for writing.
template <typename Stream, typename Optional>
void measurementItem(Stream& stream, Optional& measurement) {
  Measurement m = measurement.value_or(Measurement{});
  stream.item(m.points);
  if (m.points == 0) return;
  for (double* number : {&m.nearDistance, &m.near.rms, &m.near.max, &m.domain.rms, &m.domain.max}) stream.item(*number);
  stream.item(m.wrongSigns);
  for (double* number : {&m.signThreshold, &m.tornShare, &m.worst.x(), &m.worst.y(), &m.worst.z(), &m.toleranceRatio})
    stream.item(*number);
  stream.item(m.beyondTolerance);
  if constexpr (!std::is_const_v<Optional>) measurement = m;
}

/// Writes or reads the exactness of a combination. If it may be missing, a flag tells whether it is there. `Optional`
/// is const for writing.
template <typename Stream, typename Optional>
void exactnessItem(Stream& stream, Optional& exactness, bool mayBeMissing) {
  bool isThere = !mayBeMissing || exactness;
  if (mayBeMissing) stream.flag(isThere);
  if (!isThere) return;
  auto stored = static_cast<std::uint8_t>(exactness.value_or(Exactness::nowhere));
  stream.item(stored);
  stream.require(stored <= static_cast<std::uint8_t>(Exactness::nowhere), "its exactness is unknown");
  if constexpr (!std::is_const_v<Optional>) exactness = static_cast<Exactness>(stored);
}

/// Writes or reads every scalar of the file after its magic bytes and version, in order. `Data` is const for
/// writing.
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
  if (version < kExactLeavesVersion) return;
  settingItems(stream, m.settings, 14, 22);
  stream.item(sizes.vertexBytes);
  stream.item(sizes.vertices);
  stream.item(sizes.triangles);
  stream.item(sizes.lists);
  stream.item(data.exact.offset);
  measurementItem(stream, m.measurement);
  if (version >= kExactnessVersion) exactnessItem(stream, m.source.exactness, version >= kBlockedVersion);
  if (version < kQuantizedVersion || sizes.coefficientBytes != kQuantized) return;
  stream.item(sizes.step);
  stream.item(sizes.meanBits);
}

template <typename Reader>
constexpr bool kIsBlocked = !std::is_same_v<Reader, detail::CheckedReader>;
template <typename Reader>
constexpr bool kIsMapped = std::is_same_v<Reader, detail::MappedBlockReader>;

/// Reads the plain arrays of a file. `Reader` is `CheckedReader` or, from version 12 on, `BlockStreamReader` or
/// `MappedBlockReader`.
template <typename Reader>
class ArrayReader {
 public:
  explicit ArrayReader(Reader& reader) : reader_(reader) {}

  template <typename T>
  void read(std::vector<T>& values, std::uint64_t size) {
    align();
    reader_.array(values, size);
  }
  template <typename T>
  void read(FieldArray<T>& values, std::uint64_t size) {
    align();
    if constexpr (kIsMapped<Reader>)
      reader_.refer(values, size);
    else
      reader_.array(values.values(), size);
  }
  /// Reads `size` numbers of type float or double, whose size in bytes is `bytes`, into a variant of arrays.
  template <typename Single, typename Double, typename Variant>
  void readEither(Variant& values, std::uint32_t bytes, std::uint64_t size) {
    if (bytes == sizeof(float))
      read(values.template emplace<Single>(), size);
    else
      read(values.template emplace<Double>(), size);
  }

 private:
  void align() {
    if constexpr (kIsBlocked<Reader>) reader_.align();
  }

  Reader& reader_;
};

/// Writes the arrays as they are, each from a multiple of `kArrayAlignment` on.
void writePlain(detail::BlockWriter& writer, const FieldData& data) {
  const auto write = [&](const auto& array) {
    writer.align();
    writer.array(array, array.size());
  };
  const auto writePieces = [&](const auto& c) {
    writer.align();
    arrayOf(c).forEachPiece([&](const auto& piece) { writer.array(piece, piece.size()); });
  };
  write(data.nodes);
  std::visit(writePieces, data.coefficients);
  write(data.bounds);
  std::visit(write, data.exact.vertices);
  write(data.exact.triangles);
  write(data.exact.lists);
}

/// Reads the arrays that `writePlain` wrote.
template <typename Reader>
void readPlain(Reader& reader, const FieldSizes& sizes, FieldData& data) {
  ArrayReader<Reader> arrays(reader);
  arrays.read(data.nodes, sizes.nodes);
  if (sizes.coefficientBytes == kQuantized) {
    auto& coefficients = data.coefficients.emplace<QuantizedCoefficients>();
    coefficients.step = sizes.step;
    coefficients.meanBits = sizes.meanBits;
    arrays.read(coefficients.bytes, sizes.coefficients);
  } else {
    arrays.template readEither<FieldArray<float>, FieldArray<double>>(data.coefficients, sizes.coefficientBytes,
                                                                      sizes.coefficients);
  }
  arrays.read(data.bounds, sizes.bounds);
  arrays.template readEither<std::vector<Eigen::Vector3f>, std::vector<Eigen::Vector3d>>(
      data.exact.vertices, sizes.vertexBytes, sizes.vertices);
  arrays.read(data.exact.triangles, sizes.triangles);
  arrays.read(data.exact.lists, sizes.lists);
}

/// The first items of a file.
struct Start {
  std::uint32_t version = 0;
  bool isCompressed = false;
};

/// Reads the first items of a file. Throws `Error` unless it is a field file of a version that can be read.
Start readStart(detail::CheckedReader& reader) {
  const bool isTooShort = reader.remaining() < kFieldMagic.size();
  const std::optional<std::uint32_t> stored = reader.begin(kFieldMagic);
  if (!stored)
    reader.refuse(std::string("is not a .hpsdf file") + (isTooShort ? " (too short)" : "") +
                  "; build one with `hpsdf build`");
  const Start start{.version = *stored & ~kCompressed, .isCompressed = (*stored & kCompressed) != 0};
  constexpr std::uint32_t kLastBefore = 4;
  if (start.version == 0 || (start.version > kLastBefore && start.version < kExactLeavesVersion) ||
      start.version > kBlockedVersion || (start.isCompressed && start.version > kExactnessVersion))
    reader.refuse("has file format version " + std::to_string(start.version) + ", this program reads 1 to 4 and " +
                  std::to_string(kExactLeavesVersion) + " to " + std::to_string(kBlockedVersion) + "; build it again");
  return start;
}

}  // namespace

void save(const Field& field, const std::filesystem::path& file, const SaveOptions& options) {
  const FieldData& data = field.data();
  const FieldSizes sizes = sizesOf(data);
  if (options.compress) {
    detail::CheckedWriter writer(file);
    const std::uint32_t version = data.metadata.source.exactness ? kExactnessVersion : kShiftsVersion;
    writer.begin(kFieldMagic, version | kCompressed);
    header(writer, data, sizes, version);
    writeCompressed(writer, data);
    writer.finish();
  } else {
    detail::BlockWriter writer(file);
    writer.begin(kFieldMagic, kBlockedVersion);
    header(writer, data, sizes, kBlockedVersion);
    writePlain(writer, data);
    writer.finish();
  }
}

bool isFieldFile(const std::filesystem::path& file) {
  std::array<char, kFieldMagic.size()> first{};
  std::ifstream stream(file, std::ios::binary);
  return stream.read(first.data(), first.size()) && std::ranges::equal(first, kFieldMagic);
}

namespace {

/// Throws `Error` if the arrays of a file's header need more memory than the process may take. `isMapped` tells that
/// the coefficients need none.
void requireRoom(const std::filesystem::path& file, const FieldSizes& sizes, const Start& start, bool isMapped) {
  const double bytes = sizes.bytes() - (isMapped ? sizes.bytesOfCoefficients() : 0);
  if (bytes <= allowedMemory()) return;
  const bool canMap = start.version >= kBlockedVersion && !isMapped;
  throw Error(ErrorKind::file, file.string(),
              "its arrays would take " + bytesText(bytes) + " of memory, more than the " + bytesText(allowedMemory()) +
                  " that are three quarters of what the machine, its control group or 'ulimit -v' allows; " +
                  (canMap ? "map it" : "load it on a larger machine"));
}

/// Reads a file after its first items.
template <typename Reader>
FieldData readData(const std::filesystem::path& file, Reader& reader, const Start& start) {
  const std::uint32_t version = start.version;
  FieldData data;
  FieldSizes sizes;
  header(reader, data, sizes, version);
  const bool isQuantized = sizes.coefficientBytes == kQuantized && version >= kQuantizedVersion;
  reader.require(isQuantized || sizes.coefficientBytes == 4 || sizes.coefficientBytes == 8,
                 "its coefficients have an unknown type");
  reader.require(sizes.vertexBytes == 4 || sizes.vertexBytes == 8, "its vertices have an unknown type");
  Source& source = data.metadata.source;
  reader.require(source.insideTest <= InsideTest::outerHull, "its inside test is unknown");
  if (version < 4 && source.faces > 0) source.insideTest = InsideTest::pseudonormal;  // versions 1 to 3 had no other
  const char* misfit = misfitOf(data.grid, sizes.nodes, sizes.bounds);
  reader.require(misfit == nullptr, misfit);
  reader.require(start.isCompressed || sizes.bytes() <= double(reader.remaining()), "it ends too early");
  requireRoom(file, sizes, start, kIsMapped<Reader>);
  if constexpr (!kIsBlocked<Reader>) {
    if (start.isCompressed) {
      readCompressed(reader, sizes, data);
      reader.finish();
      return data;
    }
  }
  readPlain(reader, sizes, data);
  reader.finish();
  return data;
}

/// Reads a file whose blocks each have a checksum.
template <typename Reader>
FieldData readBlocked(const std::filesystem::path& file, const Start& start) {
  Reader reader(file, kFieldFile);
  detail::Magic magic;
  for (char& c : magic) reader.item(c);
  std::uint32_t version = 0;
  reader.item(version);
  reader.require(magic == kFieldMagic && version == start.version, "it has been replaced while it was read");
  return readData(file, reader, start);
}

FieldData readAny(const std::filesystem::path& file, detail::CheckedReader& reader, const Start& start,
                  Loading loading) {
  if (start.version < kBlockedVersion) return readData(file, reader, start);
  if (loading == Loading::mapped) return readBlocked<detail::MappedBlockReader>(file, start);
  return readBlocked<detail::BlockStreamReader>(file, start);
}

}  // namespace

bool canBeMapped(const std::filesystem::path& file) {
  try {
    detail::CheckedReader reader(file, kFieldFile);
    return readStart(reader).version >= kBlockedVersion;
  } catch (const Error&) {
    return false;
  }
}

Field load(const std::filesystem::path& file, Loading loading) {
  detail::CheckedReader reader(file, kFieldFile);
  const Start start = readStart(reader);
  if (loading == Loading::mapped && start.version < kBlockedVersion)
    reader.refuse(start.isCompressed ? "cannot be mapped, because it is compressed; load it, and save it uncompressed"
                                     : "cannot be mapped, because it has an older version; load it, and save it again");
  FieldData data = readAny(file, reader, start, loading);
  try {
    return Field(std::move(data));
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::file) throw;  // a damaged block of a mapped file
    reader.refuse(error.what());
  }
}

}  // namespace hpsdf
