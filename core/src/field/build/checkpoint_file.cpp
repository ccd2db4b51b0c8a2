#include "field/build/checkpoint_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', '.', 'c', 'p'};
// Must be raised whenever a construction would continue differently from the same state, or the layout changes.
constexpr std::uint32_t kVersion = 3;
constexpr detail::FileKind kKind{"checkpoint", "another output", "delete it to build from the start"};

class Digest {
 public:
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void add(const T& value) {
    checksum_.add(detail::bytesOf(value));
  }
  template <typename T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  void add(std::string_view text) {
    add(std::uint64_t{text.size()});
    checksum_.add(std::as_bytes(std::span(text)));
  }
  void add(const Vector3& vector) {
    for (int axis = 0; axis < 3; ++axis) add(vector[axis]);
  }
  void add(const Box& box) {
    add(box.min());
    add(box.max());
  }
  std::uint64_t value() const { return checksum_.value(); }

 private:
  detail::Checksum checksum_;
};

std::uint64_t digestOf(const Source& source) {
  Digest digest;
  digest.add(source.fingerprint);
  if (source.fingerprint == 0) digest.add(source.name);  // a mesh file with a fingerprint may be renamed
  digest.add(source.vertices);
  digest.add(source.faces);
  digest.add(source.box);
  digest.add(source.normalization.center);
  digest.add(source.normalization.scale);
  digest.add(source.insideTest);
  digest.add(source.thickness);
  return digest.value();
}

std::uint64_t digestOf(const BuildOptions& options, const Box& domain, std::string_view about) {
  Digest digest;
  for (const BuildSetting& setting : buildSettings()) {
    if (!setting.decides) continue;
    const std::vector<double> numbers = setting.get(options);
    digest.add(setting.name);
    digest.add(numbers.size());
    for (const double number : numbers) digest.add(number);
  }
  digest.add(domain);
  digest.add(about);
  return digest.value();
}

/// Digest of values of Φ on a lattice that avoids planes of symmetry.
std::uint64_t digestOf(const DistanceFunction& distance, const Box& domain) {
  constexpr int kAxis = 16;
  Digest digest;
  std::array<Vector3, kAxis * kAxis> points;
  std::array<double, points.size()> values;
  for (int z = 0; z < kAxis; ++z) {
    for (int n = 0; n < kAxis * kAxis; ++n) {
      const Vector3 part = (Vector3(n % kAxis, n / kAxis, z).array() + 0.37) / kAxis;
      points[n] = domain.min() + part.cwiseProduct(domain.sizes());
    }
    distance(points, values);
    for (const double value : values) digest.add(value);
  }
  return digest.value();
}

template <typename Stream, typename Identity>
void identityItems(Stream& stream, Identity& identity) {
  stream.text(identity.program);
  stream.item(identity.surface);
  stream.item(identity.options);
  stream.item(identity.distance);
}

void checkTimes(const Checkpoint& checkpoint) {
  constexpr double kLongest = 1e9;
  if (!(checkpoint.seconds >= 0 && checkpoint.seconds <= kLongest))
    throw Error("checkpoint: expected 0 to 1e9 seconds between two");
  if (!(checkpoint.share > 0 && checkpoint.share <= 1))
    throw Error("checkpoint: expected a share of the time above 0 up to 1");
}

}  // namespace

CheckpointFile::CheckpointFile(const Checkpoint& checkpoint, const DistanceFunction& distance, const Box& domain,
                               const BuildOptions& options)
    : checkpoint_(checkpoint),
      identity_{HPSDF_VERSION, digestOf(distance.source()), digestOf(options, domain, checkpoint.about),
                digestOf(distance, domain)} {
  checkTimes(checkpoint);
  OutputFile::removeAbandoned(checkpoint.file);
  checkWritable(checkpoint.file);
  waitFor(checkpoint.seconds);
}

std::optional<detail::CheckedReader> CheckpointFile::open() const {
  if (!std::filesystem::exists(checkpoint_.file)) return std::nullopt;
  detail::CheckedReader reader(checkpoint_.file, kKind);
  const std::string remedy = "; " + std::string(kKind.remedy) + ", or give what it was begun with";
  std::array<char, 8> magic{};
  if (reader.remaining() >= magic.size())
    for (char& c : magic) reader.item(c);
  if (magic != kMagic) reader.refuse("is no checkpoint of a construction; move it away, or give another output");
  std::uint32_t version = 0;
  reader.item(version);
  if (version != kVersion)
    reader.refuse("is a checkpoint of format version " + std::to_string(version) + ", this program reads " +
                  std::to_string(kVersion) + "; " + std::string(kKind.remedy));
  Identity found;
  identityItems(reader, found);
  if (found.program != identity_.program)
    reader.refuse("is a checkpoint of hpsdf " + found.program + ", this is " + identity_.program + "; " +
                  std::string(kKind.remedy));
  if (found.surface != identity_.surface) reader.refuse("is a checkpoint of another surface" + remedy);
  if (found.options != identity_.options) reader.refuse("is a checkpoint of a build with other options" + remedy);
  if (found.distance != identity_.distance) reader.refuse("is a checkpoint of another distance" + remedy);
  return reader;
}

bool CheckpointFile::isDue() const { return Clock::now() >= next_; }

void CheckpointFile::keep(const std::function<void(detail::CheckedWriter&)>& writeState) {
  const Clock::time_point start = Clock::now();
  try {
    detail::CheckedWriter writer(checkpoint_.file);
    for (const char c : kMagic) writer.item(c);
    writer.item(kVersion);
    identityItems(writer, identity_);
    writeState(writer);
    writer.finish();
  } catch (const Error& error) {
    if (!checkpoint_.failed) throw;
    checkpoint_.failed(error);
  }
  const double took = std::chrono::duration<double>(Clock::now() - start).count();
  waitFor(std::max(checkpoint_.seconds, took * (1 / checkpoint_.share - 1)));
}

void CheckpointFile::waitFor(double seconds) {
  next_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace hpsdf::detail
