#include "field/build/checkpoint_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "field/build/limits.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', '.', 'c', 'p'};
// to be raised whenever a construction would go on otherwise from the same state, or the state is kept otherwise
constexpr std::uint32_t kVersion = 2;
constexpr FileKind kKind{"checkpoint", "another output", "delete it to build from the start"};

class Digest {
 public:
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void add(const T& value) { checksum_.add(bytesOf(value)); }
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
  Checksum checksum_;
};

std::uint64_t digestOf(const Source& source) {
  Digest digest;
  digest.add(source.fingerprint);
  if (source.fingerprint == 0) digest.add(source.name);  // else a file may be renamed
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
  // all of them, by a form that does not compile when there is one more
  const auto& [targetError, grid, nearness, nearnessKind, nearError, farError, nearDistance, maxError, maxBytes,
               estimator, criterion, maxDegree, maxDepth, strategy, quadrature, cubature, trialSamples, band, maxSteps,
               enrich, continuityWeight, blend, bounds, coefficients, memoryLimit, threads] = options;
  Digest digest;
  const auto addAll = [&](const auto&... each) { (digest.add(each), ...); };
  addAll(targetError, grid[0], grid[1], grid[2], nearness, nearnessKind, nearError, farError, nearDistance, maxError,
         maxBytes, estimator, criterion, maxDegree, maxDepth, strategy, quadrature, cubature, trialSamples, band,
         maxSteps, enrich, continuityWeight, blend, bounds, coefficients);
  static_cast<void>(threads);      // decides nothing
  static_cast<void>(memoryLimit);  // nor does this, but whether there is a field
  digest.add(domain);
  digest.add(about);
  return digest.value();
}

/// By its values on a lattice, away from the places where shapes are symmetric.
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

/// What is kept of a fit, in bits.
enum : std::uint8_t { kFitted = 1, kOutsideBand = 2, kNear = 4, kSpare = 8, kKnown = 15 };

void coefficientItems(CheckedWriter& writer, int degree, const std::vector<double>& coefficients) {
  writer.item(static_cast<std::uint8_t>(degree));
  writer.array(std::span(coefficients));
}

void finiteItem(CheckedReader& reader, double& value) {
  reader.item(value);
  if (!std::isfinite(value)) reader.damaged("a number is not finite");
}

void coefficientItems(CheckedReader& reader, int& degree, std::vector<double>& coefficients, int least, int most) {
  std::uint8_t stored = 0;
  reader.item(stored);
  if (stored < least || stored > most) reader.damaged("a degree is out of range");
  degree = stored;
  reader.array(coefficients, static_cast<std::uint64_t>(coefficientCount(degree)));
  if (!std::ranges::all_of(coefficients, [](double c) { return std::isfinite(c); }))
    reader.damaged("a number is not finite");
}

void fitItems(CheckedWriter& writer, const Fit& fit) {
  const auto bit = [](bool set, std::uint8_t value) { return set ? value : std::uint8_t{0}; };
  const bool fitted = !fit.coefficients.empty(), spare = !fit.spare.coefficients.empty();
  writer.item(static_cast<std::uint8_t>(bit(fitted, kFitted) | bit(fit.outsideBand, kOutsideBand) |
                                        bit(fit.error.near, kNear) | bit(spare, kSpare)));
  if (fitted) {
    writer.item(fit.error.weighted);
    writer.item(fit.error.squared);
    writer.item(fit.error.volume);
    coefficientItems(writer, fit.degree, fit.coefficients);
  }
  if (spare) {
    writer.item(fit.spare.meanSquare);
    coefficientItems(writer, fit.spare.degree, fit.spare.coefficients);
  }
}

void fitItems(CheckedReader& reader, Fit& fit, int mostDegree) {
  std::uint8_t kept = 0;
  reader.item(kept);
  if (kept > kKnown) reader.damaged("a cell's bits are unknown");
  fit.outsideBand = (kept & kOutsideBand) != 0;
  fit.error.near = (kept & kNear) != 0;
  if ((kept & kFitted) != 0) {
    finiteItem(reader, fit.error.weighted);
    finiteItem(reader, fit.error.squared);
    finiteItem(reader, fit.error.volume);
    coefficientItems(reader, fit.degree, fit.coefficients, 1, mostDegree);
  }
  if ((kept & kSpare) != 0) {
    finiteItem(reader, fit.spare.meanSquare);
    coefficientItems(reader, fit.spare.degree, fit.spare.coefficients, fit.degree, kMaxDegree + 1);
  }
}

/// Gives cells below the base their places; each group of eight must have one parent, before it.
void placeChildren(const CheckedReader& reader, BuildTree& tree, int maxDepth) {
  std::vector<bool> hasParent(tree.nodes.size());
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    if (n >= tree.baseCells() && !hasParent[n]) reader.damaged("a cell has no parent");
    const std::uint64_t first = tree.nodes[n].firstChild;
    if (first == 0) continue;
    const bool isGroup = first > n && first >= tree.baseCells() && first + 8 <= tree.nodes.size() &&
                         (first - tree.baseCells()) % 8 == 0 && !hasParent[first];
    if (!isGroup || int(tree.nodes[n].depth) >= maxDepth) reader.damaged("a cell's children are not its own");
    for (std::uint64_t child = first; child < first + 8; ++child) hasParent[child] = true;
    tree.placeChildren(static_cast<std::uint32_t>(n));
  }
}

/// Whether each cell has what the construction will ask of it.
void checkFits(const CheckedReader& reader, const BuildTree& tree, std::uint64_t fitted, bool keepsAll) {
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const BuildNode& node = tree.nodes[n];
    const bool has = !node.fit.coefficients.empty(), hasSpare = !node.fit.spare.coefficients.empty();
    const bool isWaiting = n < tree.baseCells() && n >= fitted;
    const bool must = !isWaiting && (node.firstChild == 0 || keepsAll);
    if ((must && !has) || (isWaiting && (has || node.firstChild != 0)) || hasSpare != (has && keepsAll))
      reader.damaged("a cell lacks its polynomial or has one too many");
  }
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

std::optional<CheckedReader> CheckpointFile::open() const {
  if (!std::filesystem::exists(checkpoint_.file)) return std::nullopt;
  CheckedReader reader(checkpoint_.file, kKind);
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

void CheckpointFile::keep(const std::function<void(CheckedWriter&)>& writeState) {
  const Clock::time_point start = Clock::now();
  try {
    CheckedWriter writer(checkpoint_.file);
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

void treeItems(CheckedWriter& writer, const BuildTree& tree) {
  writer.item(std::uint64_t{tree.nodes.size()});
  for (const BuildNode& node : tree.nodes) {
    writer.item(node.firstChild);
    fitItems(writer, node.fit);
  }
}

void treeItems(CheckedReader& reader, BuildTree& tree, std::uint64_t fitted, const BuildOptions& options) {
  constexpr std::uint64_t kLeastBytes = sizeof(std::uint32_t) + 1;  // of a node
  const std::uint64_t base = tree.baseCells();
  std::uint64_t count = 0;
  reader.item(count);
  if (count < base || (count - base) % 8 != 0 || count > 0xffffffffu || count > reader.remaining() / kLeastBytes ||
      fitted > base || (fitted < base && count > base))
    reader.damaged("it has a number of cells that cannot be");
  checkFitsMemory({count, reader.remaining() / sizeof(double)}, options);
  tree.addBaseCells();
  tree.nodes.resize(count);
  for (BuildNode& node : tree.nodes) {
    reader.item(node.firstChild);
    fitItems(reader, node.fit, options.maxDegree);
  }
  placeChildren(reader, tree, options.maxDepth);
  checkFits(reader, tree, fitted, options.criterion == Criterion::optimal);
}

void listItems(CheckedWriter& writer, const std::vector<std::uint32_t>& nodes) {
  writer.item(std::uint64_t{nodes.size()});
  writer.array(std::span(nodes));
}

void listItems(CheckedReader& reader, std::vector<std::uint32_t>& nodes) {
  std::uint64_t count = 0;
  reader.item(count);
  reader.array(nodes, count);
}

}  // namespace hpsdf
