// The layout is described in docs/file-format.md.
#include "hpsdf/field_file.h"

#include <xxhash.h>

#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/output_file.h"

namespace hpsdf {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian and arrays are written as they are");
static_assert(sizeof(double) == 8 && std::numeric_limits<double>::is_iec559);
static_assert(sizeof(float) == 4 && std::numeric_limits<float>::is_iec559);

// Like PNG's: a carriage return, a line feed and an end-of-file mark show a transfer that took it for text.
constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', '\r', '\n', '\x1a'};
constexpr std::uint32_t kVersion =
    4;  // 1 had no steps, 2 nothing of continuity, bounds and other ways to steer, 3 no sign
constexpr std::uint64_t kUnknownSteps = ~std::uint64_t{0};
constexpr std::uint32_t kLongestName = 4096;
constexpr std::size_t kChecksumBytes = 8;

struct HashDeleter {
  void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
};

/// XXH3 (64 bits) over all bytes handed to it.
class Checksum {
 public:
  Checksum() : state_(XXH3_createState()) {
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
  }
  void add(std::span<const std::byte> bytes) { XXH3_64bits_update(state_.get(), bytes.data(), bytes.size()); }
  std::uint64_t value() const { return XXH3_64bits_digest(state_.get()); }

 private:
  std::unique_ptr<XXH3_state_t, HashDeleter> state_;
};

template <typename T>
std::span<const std::byte> bytesOf(const T& value) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  return std::as_bytes(std::span(&value, 1));
}

/// Both directions go through `header` below, so that they cannot drift apart.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& file) : output_(file) {}

  template <typename T>
  void item(const T& value) {
    put(bytesOf(value));
  }
  void text(const std::string& value) {
    const auto length = static_cast<std::uint32_t>(std::min<std::size_t>(value.size(), kLongestName));
    item(length);
    put(std::as_bytes(std::span(value.data(), length)));
  }
  void put(std::span<const std::byte> bytes) {
    checksum_.add(bytes);
    output_.write(bytes);
  }
  void finish() {
    output_.write(bytesOf(checksum_.value()));
    output_.commit();
  }

 private:
  OutputFile output_;
  Checksum checksum_;
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file) {
    std::error_code problem;
    const auto status = std::filesystem::status(file, problem);
    if (!std::filesystem::exists(status)) throw Error(file.string() + ": no such file; check the path");
    if (std::filesystem::is_directory(status)) throw Error(file.string() + ": is a folder; give a .hpsdf file");
    if (!std::filesystem::is_regular_file(status))
      throw Error(file.string() + ": is not a regular file; give a .hpsdf file");
    stream_.open(file, std::ios::binary);
    if (!stream_) throw Error(file.string() + ": cannot be opened; check its permissions");
    size_ = std::filesystem::file_size(file, problem);
    if (problem) size_ = 0;
  }

  template <typename T>
  void item(T& value) {
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  void text(std::string& value) {
    std::uint32_t length = 0;
    item(length);
    if (length > kLongestName) damaged("its name is too long");
    value.resize(length);
    get(std::as_writable_bytes(std::span(value)));
  }
  void get(std::span<std::byte> bytes) {
    if (bytes.size() > remaining()) damaged("it ends too early");
    stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!stream_) damaged("it cannot be read to its end");
    checksum_.add(bytes);
    position_ += bytes.size();
  }

  /// An array whose size the file's length must allow, looked at before memory is taken.
  template <typename T>
  void array(std::vector<T>& values, std::uint64_t count) {
    if (count > remaining() / sizeof(T)) damaged("it ends too early");
    values.resize(count);
    get(std::as_writable_bytes(std::span(values)));
  }

  void finish() {
    const std::uint64_t expected = checksum_.value();
    std::uint64_t stored = 0;
    if (remaining() != kChecksumBytes)
      damaged(remaining() < kChecksumBytes ? "it ends too early" : "it goes on too long");
    item(stored);
    if (stored != expected) damaged("its checksum is wrong");
  }

  [[noreturn]] void damaged(const std::string& how) const {
    throw Error(file_.string() + ": the field file is damaged: " + how + "; build or copy it again");
  }
  [[noreturn]] void refuse(const std::string& why) const { throw Error(file_.string() + ": " + why); }

 private:
  std::uint64_t remaining() const { return size_ - position_; }

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  Checksum checksum_;
};

struct Sizes {
  std::uint64_t nodes = 0;
  std::uint64_t coefficients = 0;
  std::uint32_t coefficientBytes = 8;
  std::uint64_t bounds = 0;
};

void stepsItem(Writer& writer, const std::optional<std::uint64_t>& steps) {
  writer.item(steps.value_or(kUnknownSteps));
}

void stepsItem(Reader& reader, std::optional<std::uint64_t>& steps) {
  std::uint64_t stored = 0;
  reader.item(stored);
  if (stored != kUnknownSteps) steps = stored;
}

void flagItem(Writer& writer, bool flag) { writer.item(std::uint8_t{flag}); }

void flagItem(Reader& reader, bool& flag) {
  std::uint8_t stored = 0;
  reader.item(stored);
  if (stored > 1) reader.damaged("a flag is neither 0 nor 1");
  flag = stored == 1;
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
  flagItem(stream, m.enriched);
  stream.item(m.continuityWeight);
  stream.item(data.blend);
  stream.item(sizes.bounds);
  if (version < 4) return;
  stream.item(m.source.sign);
  stream.item(m.source.thickness);
}

}  // namespace

void save(const Field& field, const std::filesystem::path& file) {
  const FieldData& data = field.data();
  Writer writer(file);
  for (const char c : kMagic) writer.item(c);
  writer.item(kVersion);
  std::visit(
      [&](const auto& coefficients) {
        const Sizes sizes{data.nodes.size(), coefficients.size(), sizeof(coefficients[0]), data.bounds.size()};
        header(writer, data, sizes, kVersion);
        writer.put(std::as_bytes(std::span(data.nodes)));
        writer.put(std::as_bytes(std::span(coefficients)));
      },
      data.coefficients);
  writer.put(std::as_bytes(std::span(data.bounds)));
  writer.finish();
}

Field load(const std::filesystem::path& file) {
  Reader reader(file);
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
  if (made.source.sign > Sign::shell) reader.damaged("its sign is of an unknown kind");
  if (version < 4 && made.source.faces > 0) data.metadata.source.sign = Sign::pseudonormal;  // there was no other
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
