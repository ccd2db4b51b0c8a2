#include "field/build/checkpoint_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "field/shares/fit_items.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

constexpr Magic kCheckpointMagic = {'h', 'p', 's', 'd', 'f', '.', 'c', 'p'};
// Version of the checkpoint file. It must be increased whenever the file's layout changes or a construction
// would continue differently from the same state.
constexpr std::uint32_t kCheckpointVersion = 8;
constexpr FileKind kCheckpointKind{"checkpoint", "another output", "delete it to build from the start"};

class Digest {
 public:
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void add(const T& value) { checksum_.add(bytesOf(value)); }
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
  if (source.fingerprint == 0) digest.add(source.name);  // with a fingerprint, the mesh file may be renamed
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

/// Returns a digest of the exact distances on a lattice of points that avoids planes of symmetry.
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
  digest.add(distance.hasGradients());
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

// The functions named …Item and …Items work in both directions. With a `CheckedWriter` they write the state and
// do not change it; with a `CheckedReader` they read and check it.

template <typename Stream>
void nodeItems(Stream& stream, BuildTree& tree, const FitLimits& limits) {
  for (BuildNode& node : tree.nodes) {
    stream.item(node.firstChild);
    fitItems(stream, node.fit, limits);
  }
}

/// Sets the cell indices of all cells below the base cells. Throws `Error` unless each group of eight children
/// has exactly one parent, which precedes the group.
void setCellIndices(const CheckedReader& reader, BuildTree& tree, int maxDepth) {
  std::vector<bool> hasParent(tree.nodes.size());
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    reader.require(n < tree.baseCells() || hasParent[n], "a cell has no parent");
    const std::uint64_t first = tree.nodes[n].firstChild;
    if (first == 0) continue;
    const bool isGroup = first > n && first >= tree.baseCells() && first + 8 <= tree.nodes.size() &&
                         (first - tree.baseCells()) % 8 == 0 && !hasParent[first];
    reader.require(isGroup && int(tree.nodes[n].depth) < maxDepth, "a cell's children are not its own");
    for (std::uint64_t child = first; child < first + 8; ++child) hasParent[child] = true;
    tree.setChildIndices(static_cast<std::uint32_t>(n));
  }
}

/// Throws `Error` if a cell lacks a polynomial that the construction needs, or has one that it cannot have.
void checkFits(const CheckedReader& reader, const ConstructionState& state, bool keepsAll) {
  const BuildTree& tree = state.tree;
  const bool isFitting = state.stage == ConstructionState::Stage::fitFirstCells;
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const BuildNode& node = tree.nodes[n];
    const bool isFitted = !node.fit.coefficients.empty(), isCached = !node.fit.cached.coefficients.empty();
    const bool isUnfitted = isFitting && n >= state.fittedCells && !node.fit.isFinal;
    const bool needsFit =
        node.firstChild == 0 ? !isUnfitted && !node.fit.isExact() : keepsAll && !isFitting && n >= state.fittedCells;
    const bool isSuperfluous = (isUnfitted || node.fit.isExact()) && isFitted;
    const bool needsCached = isFitted && keepsAll && !node.fit.isFinal;
    reader.require(!(needsFit && !isFitted) && !isSuperfluous && isCached == needsCached,
                   "a cell lacks its polynomial or has one too many");
  }
}

void readTree(CheckedReader& reader, ConstructionState& state, const ConstructionSetup& setup) {
  const BuildOptions& options = setup.options;
  BuildTree& tree = state.tree;
  constexpr std::uint64_t kLeastBytes = sizeof(std::uint32_t) + 1;  // least size of a node in the file
  const std::uint64_t base = tree.baseCells();
  std::uint64_t count = 0;
  reader.item(count);
  reader.require(count >= base && (count - base) % 8 == 0 && count <= 0xffffffffu &&
                     count <= reader.remaining() / kLeastBytes && state.fittedCells <= count,
                 "it has a number of cells that cannot be");
  requireMemory({.nodes = count, .coefficients = reader.remaining() / sizeof(double)}, options);
  tree.addBaseCells();
  tree.nodes.resize(count);
  nodeItems(reader, tree,
            {.mostDegree = options.maxDegree,
             .triangles = setup.exactCells ? setup.exactCells->search().triangles().size() : 0});
  setCellIndices(reader, tree, options.maxDepth);
  checkFits(reader, state, options.criterion == Criterion::optimal);
}

/// Writes or reads every scalar of the construction state, in the order of the file.
template <typename Stream>
void scalarItems(Stream& stream, ConstructionState& state, std::uint64_t& evaluations) {
  stream.item(state.stage);
  stream.item(state.fittedCells);
  stream.item(state.steps);
  stream.item(evaluations);
  stream.item(state.nearness.kind);
  stream.item(state.nearness.exponent);
  stream.item(state.measuredError);
  stream.flag(state.isFull);
  stream.item(state.coefficientBytes);
  stream.item(state.processed);
}

/// Throws `Error` unless all `nodes` are indices of leaves and no index occurs twice.
void requireLeaves(const CheckedReader& reader, const BuildTree& tree, std::span<const std::uint32_t> nodes) {
  std::vector<bool> isNamed(tree.nodes.size());
  for (const std::uint32_t n : nodes) {
    reader.require(n < isNamed.size() && !isNamed[n] && tree.nodes[n].firstChild == 0, "it names a cell that is none");
    isNamed[n] = true;
  }
}

}  // namespace

std::uint64_t digestOfInputs(const Source& source, const BuildOptions& options, const Box& domain) {
  Digest digest;
  digest.add(digestOf(source));
  digest.add(digestOf(options, domain, {}));
  return digest.value();
}

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
  CheckedReader reader(checkpoint_.file, kCheckpointKind);
  const std::string remedy = "; " + std::string(kCheckpointKind.remedy) + ", or give what it was begun with";
  const std::optional<std::uint32_t> version = reader.begin(kCheckpointMagic);
  if (!version) reader.refuse("is no checkpoint of a construction; move it away, or give another output");
  if (*version != kCheckpointVersion)
    reader.refuse("is a checkpoint of format version " + std::to_string(*version) + ", this program reads " +
                  std::to_string(kCheckpointVersion) + "; " + std::string(kCheckpointKind.remedy));
  Identity found;
  identityItems(reader, found);
  if (found.program != identity_.program)
    reader.refuse("is a checkpoint of hpsdf " + found.program + ", this is " + identity_.program + "; " +
                  std::string(kCheckpointKind.remedy));
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
    writer.begin(kCheckpointMagic, kCheckpointVersion);
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

void write(MessageWriter& message, ConstructionState& state, std::uint64_t evaluations) {
  scalarItems(message, state, evaluations);
}

std::uint64_t read(const Message& message, ConstructionState& state) {
  MessageReader reader(message);
  std::uint64_t evaluations = 0;
  scalarItems(reader, state, evaluations);
  return evaluations;
}

void save(CheckedWriter& writer, ConstructionState& state, std::uint64_t evaluations) {
  scalarItems(writer, state, evaluations);
  writer.item(std::uint64_t{state.tree.nodes.size()});
  nodeItems(writer, state.tree, {});
  writer.list(state.deferred);
  writer.list(state.pending);
}

std::uint64_t restore(CheckedReader& reader, ConstructionState& state, const ConstructionSetup& setup) {
  std::uint64_t evaluations = 0;
  scalarItems(reader, state, evaluations);
  reader.require(state.coefficientBytes >= 0 && state.coefficientBytes <= sizeof(double),
                 "its bytes of a coefficient are out of range");
  reader.require(state.stage <= ConstructionState::Stage::probe && state.nearness.kind <= NearnessKind::exponential,
                 "it is at an unknown stage");
  readTree(reader, state, setup);
  reader.list(state.deferred);
  reader.list(state.pending);
  reader.finish();
  const bool isFitting = state.stage == ConstructionState::Stage::fitFirstCells;
  reader.require((isFitting || state.fittedCells >= state.tree.baseCells()) && state.processed <= state.pending.size(),
                 "its numbers do not belong together");
  requireLeaves(reader, state.tree, state.deferred);
  requireLeaves(reader, state.tree, std::span(state.pending).subspan(state.processed));
  return evaluations;
}

}  // namespace hpsdf::detail
