#pragma once
// Processes that build one field together.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// A group of processes, the ranks 0 … `count() - 1`, that send each other messages. All of them must make the same
/// calls in the same order. The processes must run on machines of the same byte order. If a rank has no memory for the
/// messages that it receives, a call throws on all ranks, which may then make further calls.
class Ranks {
 public:
  using Message = std::vector<std::byte>;

  Ranks() = default;
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  virtual int rank() const = 0;
  virtual int count() const = 0;

  /// Sends a message to all ranks and returns those of all ranks, by rank. Calls `whileWaiting`, if it is not empty,
  /// again and again until the messages are there. Rethrows what it throws, once this call matches those of the other
  /// ranks; if it is `Cancelled`, after a short while in any case.
  virtual std::vector<Message> gatherAll(std::span<const std::byte> own, const std::function<void()>& whileWaiting) = 0;

  /// Sends message number r to rank r, and returns the messages to this rank, by sender.
  virtual std::vector<Message> exchange(std::vector<Message> toEach) = 0;
};

/// Builds the same field as `build`, bit for bit, by processes that share the octree and its refinement. Each of them
/// needs the whole distance, and must pass the same arguments; threads may differ. Each rank holds, refines and rounds
/// a part of the octree. Rank 0 puts the parts of the field together, computes bounds and returns the field; the others
/// return std::nullopt. For the optimal criterion, weak continuity, a maximum error and exact leaves, rank 0 gets the
/// whole octree after the refinement and goes on alone. If `checkpoint` is given, rank 0 saves the state of the
/// construction and continues from it as `buildResumably` does, also from a state that was saved by another number of
/// processes.
///
/// Throws as `build` and `buildResumably` do. Ranks where nothing failed throw an `Error` with the message of the first
/// that did, unless they have done their part and returned. Also throws `Error` for a tolerance and for a limit of
/// bytes, and on all ranks if their surfaces (`Source`), domains or options differ.
std::optional<Field> buildByRanks(Ranks& ranks, const DistanceFunction& distance, const Box& domain,
                                  const BuildOptions& options, const Checkpoint* checkpoint = nullptr,
                                  const Progress& progress = {});

/// Returns, on all ranks, the text that rank 0 passes. Waits until all ranks have called this function. Throws `Error`
/// on all of them if one has called `failBefore` instead; none of them calls another function of ranks then.
std::string textOfFirst(Ranks& ranks, const std::string& text);

/// Tells the other ranks that this one fails before it calls `buildByRanks`. They call that function or `textOfFirst`,
/// which throw, or this one.
void failBefore(Ranks& ranks, const std::string& why);

}  // namespace hpsdf
