#pragma once
// One rank's side of a construction by several processes (`Ranks`): messages, failures, sums, and parts of the octree.

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "field/nearness.h"
#include "field/shares/field_parts.h"
#include "field/shares/tree_parts.h"
#include "hpsdf/parallel/ranks.h"
#include "util/across_parts.h"

namespace hpsdf::detail {

/// Thrown on all ranks if one of them has failed, so that none waits for it.
class SharedFailure : public Error {
 public:
  using Error::Error;
};

/// The members that send messages are called by all ranks in the same order. They throw `SharedFailure` once a rank has
/// called `fail`.
class Shares {
 public:
  explicit Shares(Ranks& ranks) : ranks_(ranks) {}

  int rank() const { return ranks_.rank(); }
  int count() const { return ranks_.count(); }
  bool isFirst() const { return rank() == 0; }

  /// Sends a message to all ranks and returns those of all ranks, by rank. Calls `whileWaiting` meanwhile.
  std::vector<Message> gatherAll(Message own, const std::function<void()>& whileWaiting = {});

  /// Tells all other ranks, in place of the call that they make or will make, that this one has failed. Waits for them,
  /// at most so many seconds. Does nothing after `close`.
  void fail(const std::string& why, double seconds = std::numeric_limits<double>::infinity());

  /// Ends the common work: there are no more calls.
  void close() { isOpen_ = false; }

  /// Returns the sum over all ranks.
  std::uint64_t sum(std::uint64_t value);
  /// Make the sums of a rank those over all ranks.
  void add(ExactSum& sum);
  void add(ExactTotals& totals);

  /// Returns the greatest number of all ranks.
  double greatest(double own);
  /// Returns true if all ranks pass the same number.
  bool areEqual(std::uint64_t value);

  /// Returns the functions for numbers over all ranks.
  AcrossParts across();

  /// Returns the field whose parts the ranks hold, on rank 0; a field without nodes on the others.
  FieldData gatheredAtFirst(FieldData&& part);

  /// Returns what rank 0 has passed.
  Message fromFirst(Message own);

  /// A part of an octree, with its leaves that are set aside.
  struct Part {
    BuildTree& tree;
    std::vector<std::uint32_t>& deferred;
  };

  /// Tells the weight of a leaf, which is 0 for leaves that other ranks hold.
  using WeightOf = std::function<double(const BuildNode&)>;

  /// Returns the weight of the leaves of each rank.
  std::vector<double> weights(const BuildTree& tree, const WeightOf& weightOf);

  /// Divides the leaves, whose weights by rank are `weights`, anew. Each rank gets an interval of the Morton curve, and
  /// all of them get about the same weight. The ranks must hold successive intervals already.
  void divide(const Part& part, int maxDepth, const WeightOf& weightOf, const std::vector<double>& weights);

  /// Takes the octree from all ranks to rank 0.
  void gatherAtFirst(const Part& part);

 private:
  std::vector<Message> exchange(std::vector<Message> toEach);
  /// Returns the first places of the parts of ranks 1, 2, …
  std::vector<MortonPlace> boundaries(const BuildTree& tree, int maxDepth, const WeightOf& weightOf,
                                      const std::vector<double>& weights);
  /// Gives each node that a rank holds to another one, or leaves it where it is.
  void move(const Part& part, const std::function<int(const BuildNode&)>& rankOf);

  Ranks& ranks_;
  bool isOpen_ = true;
};

}  // namespace hpsdf::detail
