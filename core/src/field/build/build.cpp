#include "hpsdf/build.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "field/build/checkpoint_file.h"
#include "field/build/construction.h"
#include "field/build/tolerance_build.h"
#include "field/shares/shares.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "hpsdf/parallel/ranks.h"
#include "util/refuse.h"

namespace hpsdf {
namespace {

using namespace detail;

/// Throws `Error` if the options ask for a tolerance, which goes without the steps of Algorithm 1.
void refuseTolerance(const BuildOptions& options, const char* what) {
  if (options.tolerance > 0)
    throw Error(std::string("a construction within a tolerance has no steps, and so no ") + what + ": leave out the " +
                what + " or the tolerance");
}

}  // namespace

void checkBuild(const Box& domain, const BuildOptions& options) { checkOptions(domain, options); }

Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options, const Progress& progress,
            const OfferField& offer) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    if (options.tolerance > 0) return buildWithinTolerance(distance, domain, options, progress);
    const BuildOptions settings = settled(options, distance, domain, progress);
    Construction construction(distance, domain, settings, progress);
    construction.offerTo(offer);
    construction.grow();
    return construction.finish();
  }));
}

Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress) {
  checkOptions(domain, options);
  refuseTolerance(options, "checkpoint");
  return Field(withThreads(options.threads, [&] {
    const BuildOptions settings = settled(options, distance, domain, progress);
    CheckpointFile file(checkpoint, distance, domain, settings);
    Construction construction(distance, domain, settings, progress);
    if (construction.resume(file) && checkpoint.resumed) checkpoint.resumed(construction.steps());
    construction.grow();
    return construction.finish();
  }));
}

std::optional<Field> buildByRanks(Ranks& ranks, const DistanceFunction& distance, const Box& domain,
                                  const BuildOptions& options, const Checkpoint* checkpoint, const Progress& progress) {
  Shares shares(ranks);
  const auto construct = [&]() -> std::optional<FieldData> {
    const BuildOptions settings = settled(options, distance, domain, progress);
    if (!shares.areEqual(digestOfInputs(distance.source(), settings, domain)))
      throw Error("the processes have different surfaces, domains or options; start all of them with the same command");
    std::optional<CheckpointFile> file;
    if (checkpoint != nullptr && shares.isFirst()) file.emplace(*checkpoint, distance, domain, settings);
    Construction construction(distance, domain, settings, progress);
    construction.shareWith(shares);
    if (file && construction.resume(*file) && checkpoint->resumed) checkpoint->resumed(construction.steps());
    construction.grow();
    if (!construction.goesOn()) return std::nullopt;
    FieldData field = construction.finish();
    return shares.isFirst() ? std::optional(std::move(field)) : std::nullopt;
  };
  try {
    checkOptions(domain, options);
    for (const auto& [isGiven, what] :
         {std::pair(options.tolerance > 0, "tolerance"), std::pair(options.maxBytes.has_value(), "limit of bytes")})
      if (isGiven)
        refuseOptions("several processes cannot build a field within a ", what, ": leave out the ", what,
                      ", or start one process");
    std::optional<FieldData> data = withThreads(options.threads, construct);
    return data ? std::optional<Field>(std::move(*data)) : std::nullopt;
  } catch (const Cancelled& cancelled) {
    // The other ranks are probably cancelled too, or killed, and so is this one if it waits for long.
    constexpr double kSeconds = 0.3;
    shares.fail(cancelled.what(), kSeconds);
    throw;
  } catch (const std::exception& error) {
    shares.fail(error.what());  // the other ranks need not wait for this one
    throw;
  } catch (...) {
    shares.fail("a function that was passed to the construction has thrown");
    throw;
  }
}

std::string textOfFirst(Ranks& ranks, const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  const std::vector<std::byte> first = Shares(ranks).fromFirst({bytes.begin(), bytes.end()});
  return {reinterpret_cast<const char*>(first.data()), first.size()};
}

void failBefore(Ranks& ranks, const std::string& why) { Shares(ranks).fail(why); }

void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress) {
  if (!std::ranges::is_sorted(steps)) throw Error("stages of a construction: expected steps that do not descend");
  if (steps.empty()) return;
  BuildOptions limited = options;
  limited.maxSteps = std::min(options.maxSteps.value_or(steps.back()), steps.back());
  checkOptions(domain, limited);
  refuseTolerance(options, "stages");
  withThreads(options.threads, [&] {
    limited.strategy = settled(options, distance, domain, progress).strategy;
    Construction construction(distance, domain, limited, progress);
    std::size_t stage = 0;
    const auto visitNext = [&] {
      visit(construction.snapshot());
      ++stage;
    };
    construction.grow([&](std::uint64_t taken) {
      while (stage < steps.size() && steps[stage] == taken) visitNext();
    });
    while (stage < steps.size()) visitNext();  // the construction ended before the remaining stages
  });
}

}  // namespace hpsdf
