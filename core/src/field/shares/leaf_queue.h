#pragma once
// The leaves that a construction may refine, in order, with the refinements that were tried already.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <vector>

#include "field/cells/build_tree.h"

namespace hpsdf::detail {

/// A leaf's place in the order of refinement: leaves with greater errors come first. The places of cells decide between
/// equal errors, so that the order does not depend on the numbers of nodes.
struct LeafRank {
  double error = 0;
  CellPlace place;

  bool operator<(const LeafRank& other) const { return key() < other.key(); }

 private:
  std::tuple<double, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t> key() const {
    return {-error, place.depth, place.index[2], place.index[1], place.index[0]};
  }
};

/// A priority queue of leaves. It keeps trials of leaves that are still in the queue, so that a process that waits for
/// others can try leaves ahead of their turn.
class LeafQueue {
 public:
  /// The queue refers to the nodes of `tree`.
  explicit LeafQueue(const BuildTree& tree) : tree_(tree), rest_(Later{&tree}) {}

  bool isEmpty() const { return front_.empty() && rest_.empty(); }
  void push(std::uint32_t leaf);
  /// Removes the first leaf from the queue, which must not be empty, and returns its number.
  std::uint32_t pop();

  /// Returns the first leaf without a trial, and keeps it in the queue. Returns std::nullopt if the `most` first leaves
  /// have trials.
  std::optional<std::uint32_t> firstUntried(std::size_t most);
  void keepTrial(std::uint32_t leaf, Trial&& trial);
  bool hasTrial(std::uint32_t leaf) const { return trials_.contains(leaf); }
  const Trial& trial(std::uint32_t leaf) const { return trials_.at(leaf); }
  Trial takeTrial(std::uint32_t leaf);

  /// Removes all leaves from the queue, and returns the trials.
  std::map<LeafRank, Trial> takeAll();

  LeafRank rankOf(std::uint32_t leaf) const {
    const BuildNode& node = tree_.nodes[leaf];
    return {node.fit.error.weighted, {node.depth, node.cellIndex}};
  }

 private:
  struct Entry {
    double error;
    std::uint32_t node;
  };
  /// Orders entries by `LeafRank`, so that the first leaf is on top of a priority queue.
  struct Later {
    const BuildTree* tree;
    bool operator()(const Entry& a, const Entry& b) const {
      if (a.error != b.error) return a.error < b.error;
      const BuildNode &first = tree->nodes[a.node], &second = tree->nodes[b.node];
      return LeafRank{0, {second.depth, second.cellIndex}} < LeafRank{0, {first.depth, first.cellIndex}};
    }
  };

  const BuildTree& tree_;
  std::map<LeafRank, std::uint32_t> front_;    ///< leaves that come before all of `rest_`
  std::map<LeafRank, std::uint32_t> untried_;  ///< those of them without trials
  std::priority_queue<Entry, std::vector<Entry>, Later> rest_;
  std::map<std::uint32_t, Trial> trials_;
};

}  // namespace hpsdf::detail
