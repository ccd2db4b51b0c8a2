#include "hpsdf/physics/contacts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "hpsdf/error.h"
#include "rigid_transform.h"

namespace hpsdf::physics {
namespace {

constexpr std::size_t kBlock = 8;  // number of body pairs that one task handles

/// Throws `Error` if the pair is invalid. The message starts with the pair's number if `number` is given.
/// Allocates no memory if the pair is valid.
void requireValid(const BodyPair& pair, std::optional<std::size_t> number = {}) {
  const auto refuse = [&](const std::string& what) {
    throw Error((number ? "pair " + std::to_string(*number) + ": " : std::string()) + what);
  };
  if (pair.samples == nullptr || pair.field == nullptr) refuse("samples or field are missing");
  if (const char* fault = transformFault(pair.worldFromSamples)) refuse(std::string("the samples' ") + fault);
  if (const char* fault = transformFault(pair.worldFromField)) refuse(std::string("the field's ") + fault);
}

void requireValid(const ContactOptions& options) {
  if (!(options.margin >= 0) || !std::isfinite(options.margin))
    throw Error("contacts: the margin must be a number, 0 or more");
  if (options.deepest == std::size_t{0}) throw Error("contacts: the number of the deepest must be 1 or more");
}

/// The query of one body pair. It collects the samples that may be contacts and evaluates the field at these
/// samples in batches.
class Search {
 public:
  Search(const BodyPair& pair, const ContactOptions& options, std::vector<Contact>& out)
      : pair_(pair),
        margin_(options.margin),
        fieldFromSamples_(pair.worldFromField.inverse() * pair.worldFromSamples),
        out_(out) {}

  QueryCost run() {
    const std::span<const Sphere> spheres = pair_.samples->spheres();
    // Compute the tolerance of the sphere tests. Rounding, and rotations that are not exact, may move a sample
    // out of its bounding sphere.
    const double size = fieldFromSamples_.translation().norm() + spheres[0].center.norm() + spheres[0].radius;
    const double slack = margin_ + 32 * std::numeric_limits<double>::epsilon() * size;
    for (std::uint32_t node = 0; node < spheres.size();) {
      const Sphere& sphere = spheres[node];
      ++cost_.spheres;
      if (pair_.field->lowerBoundAround(fieldFromSamples_ * sphere.center) >
          sphere.radius * (1 + 4 * kRotationTolerance) + slack) {
        node = sphere.next;
        continue;
      }
      if (++node == sphere.next) collect(sphere.begin, sphere.end);
    }
    evaluate();
    return cost_;
  }

 private:
  static constexpr std::size_t kBatch = 128;

  void collect(std::uint32_t begin, std::uint32_t end) {
    cost_.samples += end - begin;
    for (std::uint32_t sample = begin; sample < end; ++sample) {
      const Vector3 x = fieldFromSamples_ * pair_.samples->points()[sample];
      if (pair_.field->lowerBound(x) > margin_) continue;
      samples_[count_] = sample;
      points_[count_] = x;
      if (++count_ == kBatch) evaluate();
    }
  }

  void evaluate() {
    cost_.evaluations += count_;
    pair_.field->field().valuesAndGradients({points_.data(), count_}, {results_.data(), count_});
    for (std::size_t i = 0; i < count_; ++i)
      if (results_[i].value <= margin_) add(samples_[i], results_[i]);
    count_ = 0;
  }

  void add(std::uint32_t sample, const ValueAndGradient& result) {
    const double steepness = result.gradient.norm();
    const Vector3 normal = steepness > 0 ? Vector3(pair_.worldFromField.linear() * (result.gradient / steepness))
                                         : Vector3(pair_.worldFromSamples.linear() * -pair_.samples->normals()[sample]);
    out_.push_back({sample, -result.value, pair_.worldFromSamples * pair_.samples->points()[sample], normal});
  }

  const BodyPair& pair_;
  const double margin_;
  const Eigen::Isometry3d fieldFromSamples_;
  std::vector<Contact>& out_;
  QueryCost cost_;
  std::size_t count_ = 0;
  std::array<std::uint32_t, kBatch> samples_;
  std::array<Vector3, kBatch> points_;
  std::array<ValueAndGradient, kBatch> results_;
};

/// Sorts the contacts with indices of at least `first` by depth, and keeps only the deepest `count` of them.
void keepDeepest(std::size_t count, std::size_t first, std::vector<Contact>& contacts) {
  const auto begin = contacts.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(count, contacts.size() - first));
  std::partial_sort(begin, end, contacts.end(), [](const Contact& a, const Contact& b) {
    return a.depth != b.depth ? a.depth > b.depth : a.sample < b.sample;
  });
  contacts.erase(end, contacts.end());
}

}  // namespace

QueryCost& QueryCost::operator+=(const QueryCost& other) {
  spheres += other.spheres;
  samples += other.samples;
  evaluations += other.evaluations;
  return *this;
}

std::span<const Contact> ContactQuery::find(const BodyPair& pair, const ContactOptions& options) {
  requireValid(options);
  requireValid(pair);
  clear();
  append(pair, options);
  return contacts_;
}

void ContactQuery::clear() {
  contacts_.clear();
  cost_ = {};
}

void ContactQuery::append(const BodyPair& pair, const ContactOptions& options) {
  const std::size_t first = contacts_.size();
  cost_ += Search(pair, options, contacts_).run();
  if (options.deepest) keepDeepest(*options.deepest, first, contacts_);
}

std::span<const Contact> PairContacts::of(std::size_t pair) const {
  const std::size_t begin = pair == 0 ? 0 : ends_[pair - 1];
  return std::span(contacts_).subspan(begin, ends_[pair] - begin);
}

void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out) {
  requireValid(options);
  for (std::size_t i = 0; i < pairs.size(); ++i) requireValid(pairs[i], i);
  const std::size_t blocks = (pairs.size() + kBlock - 1) / kBlock;
  if (out.blocks_.size() < blocks) out.blocks_.resize(blocks);  // never shrinks, so that its memory is reused

  // Query the pairs in parallel, in blocks of consecutive pairs.
  out.pairs_ = pairs.size();
  out.ends_.resize(pairs.size());
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t number) {
    ContactQuery& block = out.blocks_[number];
    block.clear();
    for (std::size_t i = number * kBlock; i < std::min(pairs.size(), (number + 1) * kBlock); ++i) {
      block.append(pairs[i], options);
      out.ends_[i] = block.contacts_.size();
    }
  });

  // Concatenate the contacts of all blocks, in the order of the pairs.
  out.contacts_.clear();
  out.cost_ = {};
  for (std::size_t number = 0; number < blocks; ++number) {
    const ContactQuery& block = out.blocks_[number];
    for (std::size_t i = number * kBlock; i < std::min(pairs.size(), (number + 1) * kBlock); ++i)
      out.ends_[i] += out.contacts_.size();
    out.contacts_.insert(out.contacts_.end(), block.contacts_.begin(), block.contacts_.end());
    out.cost_ += block.cost_;
  }
}

}  // namespace hpsdf::physics
