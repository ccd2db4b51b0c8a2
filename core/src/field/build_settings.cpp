#include "hpsdf/detail/build_settings.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <type_traits>

namespace hpsdf {
namespace {

using Type = BuildSetting::Type;
using Ending = BuildSetting::Ending;
using Numbers = std::vector<double>;
using Values = std::span<const double>;

constexpr double kMostInt = std::numeric_limits<int>::max();
constexpr double kMostBytes = 1e15;

template <typename T>
struct Member {
  static constexpr bool isChecked = std::is_same_v<T, double> || std::is_same_v<T, int>;
  static Numbers get(const T& value) { return {static_cast<double>(value)}; }
  static void set(T& value, Values numbers) {
    if constexpr (std::is_same_v<T, bool>)
      value = numbers[0] != 0;
    else if constexpr (std::is_same_v<T, double>)
      value = numbers.empty() ? 0 : numbers[0];
    else  // by way of 64 bits, into which every number of a damaged file fits
      value = static_cast<T>(static_cast<std::int64_t>(numbers[0]));
  }
};

template <typename T>
struct Member<std::optional<T>> {
  static constexpr bool isChecked = std::is_same_v<T, double>;
  static Numbers get(const std::optional<T>& value) { return value ? Numbers{static_cast<double>(*value)} : Numbers{}; }
  static void set(std::optional<T>& value, Values numbers) {
    value.reset();
    if (!numbers.empty()) value = static_cast<T>(numbers[0]);
  }
};

template <>
struct Member<std::array<std::uint32_t, 3>> {
  static constexpr bool isChecked = false;
  static Numbers get(const std::array<std::uint32_t, 3>& value) { return {value.begin(), value.end()}; }
  static void set(std::array<std::uint32_t, 3>& value, Values numbers) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      value[axis] = static_cast<std::uint32_t>(numbers[numbers.size() == 1 ? 0 : axis]);
  }
};

/// Completes a setting with the access to its member of `BuildOptions`.
template <auto kMember>
BuildSetting member(BuildSetting setting) {
  using Access = Member<std::remove_reference_t<decltype(std::declval<BuildOptions>().*kMember)>>;
  setting.isChecked = Access::isChecked;
  setting.get = [](const BuildOptions& options) { return Access::get(options.*kMember); };
  setting.set = [](BuildOptions& options, Values numbers) { Access::set(options.*kMember, numbers); };
  return setting;
}

/// Makes 0 of a number stand for a setting that asks for nothing.
template <auto kMember>
BuildSetting positiveMember(BuildSetting setting) {
  setting = member<kMember>(setting);
  setting.get = [](const BuildOptions& options) {
    const double value = options.*kMember;
    return value == 0 ? Numbers{} : Numbers{value};
  };
  return setting;
}

/// Completes a setting with the access to a member of the errors by distance, for which 0 stands for none.
template <auto kMember>
BuildSetting nearFarMember(BuildSetting setting) {
  setting.isChecked = true;
  setting.get = [](const BuildOptions& options) {
    const double value = options.targetError.byDistance().*kMember;
    return value == 0 ? Numbers{} : Numbers{value};
  };
  setting.set = [](BuildOptions& options, Values numbers) {
    NearFarError error = options.targetError.byDistance();
    error.*kMember = numbers.empty() ? 0 : numbers[0];
    options.targetError = error;
  };
  return setting;
}

BuildSetting targetError(BuildSetting setting) {
  setting.isChecked = true;
  setting.get = [](const BuildOptions& options) {
    const double weighted = options.targetError.weighted();
    return weighted == 0 ? Numbers{} : Numbers{weighted};
  };
  setting.set = [](BuildOptions& options, Values numbers) { options.targetError = numbers.empty() ? 0 : numbers[0]; };
  return setting;
}

/// Both kinds of continuity as one choice: weak has bit 0 of the word's index, exact bit 1.
BuildSetting continuity(BuildSetting setting) {
  setting.get = [](const BuildOptions& options) {
    return Numbers{(options.continuityWeight ? 1.0 : 0.0) + (options.blend > 0 ? 2.0 : 0.0)};
  };
  setting.set = [](BuildOptions& options, Values numbers) {
    const int kinds = static_cast<int>(numbers[0]);
    options.continuityWeight.reset();
    if ((kinds & 1) != 0) options.continuityWeight = WeakContinuity{}.weight;
    options.blend = (kinds & 2) != 0 ? kDefaultBlend : 0;
  };
  return setting;
}

/// The goal of the construction, and its limits of bytes.
const std::vector<BuildSetting> kGoals = {
    targetError(
        {.name = "target-error",
         .help = "τ, the weighted squared error to reach, for a mesh whose longest side is 2; internally τ·(L/2)^5, "
                 "where L is that side in mesh units, so that the same τ gives the same cells in any unit. Smaller "
                 "is more exact.",
         .unit = "units^5 at that scale",
         .minimum = 0,
         .minimumExcluded = true,
         .ending = Ending::target,
         .storedAt = 1}),
    member<&BuildOptions::grid>({.name = "grid",
                                 .type = Type::wholeNumbers,
                                 .help = "Base cells an axis: one number for all, or NX,NY,NZ.",
                                 .minimum = 1,
                                 .maximum = kMostInt}),
    member<&BuildOptions::nearness>(
        {.name = "nearness",
         .help = "θ: how much more an error counts near the surface than far away; 0 weighs all cells alike.",
         .minimum = 0,
         .maximum = 1000,
         .storedAt = 2}),
    member<&BuildOptions::nearnessKind>(
        {.name = "nearness-kind",
         .type = Type::choice,
         .help = "How an error's weight falls with the distance s, where d is the domain's diagonal: polynomial, (1 − "
                 "s/d)^θ, as in the paper, or exponential, exp(−θ s/d), which goes on falling far away.",
         .words = {"polynomial", "exponential"},
         .storedAt = 10}),
    nearFarMember<&NearFarError::near>(
        {.name = "near-error",
         .help =
             "RMS error to reach near the surface, with far-error, in place of target error and nearness, which then "
             "follow, nearness by its exponential kind. By the estimate: 'hpsdf verify' measures what came of it.",
         .unit = "world units",
         .minimum = 0,
         .minimumExcluded = true,
         .ending = Ending::byDistance,
         .exclusive = "target-error"}),
    nearFarMember<&NearFarError::far>(
        {.name = "far-error",
         .help = "RMS error to reach farther away than near-distance, with near-error; not below it.",
         .unit = "world units",
         .minimum = 0,
         .minimumExcluded = true,
         .ending = Ending::byDistance,
         .exclusive = "target-error"}),
    nearFarMember<&NearFarError::nearDistance>(
        {.name = "near-distance",
         .help = "Distance up to which near-error holds. When left out, a hundredth of the mesh's longest side.",
         .unit = "world units",
         .minimum = 0,
         .minimumExcluded = true,
         .owner = "near-error",
         .hasOwner = [](const BuildOptions& options) { return options.targetError.byDistance().near > 0; }}),
    positiveMember<&BuildOptions::maxError>(
        {.name = "max-error",
         .help = "Error to be exceeded nowhere (within the band, if there is one): after the target, if one is "
                 "given, every cell is probed at 512 points and refined where the error is greater. Expensive; "
                 "takes no target error unless one is given.",
         .unit = "world units",
         .minimum = 0,
         .minimumExcluded = true,
         .ending = Ending::otherQuantity,
         .storedAt = 11}),
    member<&BuildOptions::maxBytes>(
        {.name = "max-bytes",
         .type = Type::wholeNumber,
         .help = "The best field of at most so many bytes of memory, e.g. 4e6. Takes no target error unless one is "
                 "given; with max-error it ends where that is reached.",
         .unit = "bytes",
         .minimum = 1,
         .maximum = kMostBytes,
         .ending = Ending::otherQuantity}),
    member<&BuildOptions::memoryLimit>(
        {.name = "memory-limit",
         .type = Type::wholeNumber,
         .help = "Memory that the construction may take, the mesh's exact distance included. Where more will be "
                 "needed it stops as soon as that is certain, and tells how much. Weak continuity's solver takes "
                 "about 50 bytes a coefficient on top, and a hull's pieces 80 MB at most. Left out: 1e8 besides that "
                 "distance, some 240,000 cells, where target error, grid and max-steps are left out too; most "
                 "meshes take less than 100,000 then. Else three quarters of the machine's memory, or of what its "
                 "control group allows.",
         .unit = "bytes",
         .minimum = 1,
         .maximum = kMostBytes,
         .decides = false}),
};

/// The refinement of cells.
const std::vector<BuildSetting> kRefinement = {
    member<&BuildOptions::estimator>(
        {.name = "estimator",
         .type = Type::choice,
         .help = "What estimates a cell's error: embedded, the coefficients of the top degree, as in the paper, or "
                 "residual, the part of its samples that the fit does not represent. Neither evaluates the distance.",
         .words = {"embedded", "residual"},
         .storedAt = 8}),
    member<&BuildOptions::criterion>(
        {.name = "criterion",
         .type = Type::choice,
         .help = "How degrees and depths are chosen. paper: step by step, by the gain a coefficient. optimal: a "
                 "little farther than needed, then back where that saves most bytes for the error: about half of the "
                 "coefficients at equal error, for 1.3 times the distances.",
         .words = {"paper", "optimal"},
         .storedAt = 9}),
    member<&BuildOptions::maxDegree>({.name = "max-degree",
                                      .type = Type::wholeNumber,
                                      .help = "Highest degree of a cell's polynomial.",
                                      .minimum = 1,
                                      .maximum = kMaxDegree,
                                      .storedAt = 3}),
    member<&BuildOptions::maxDepth>({.name = "max-depth",
                                     .type = Type::wholeNumber,
                                     .help = "How often a base cell may be halved.",
                                     .minimum = 0,
                                     .maximum = kMaxDepth,
                                     .storedAt = 4}),
    member<&BuildOptions::maxSteps>(
        {.name = "max-steps",
         .type = Type::wholeNumber,
         .help = "End after so many steps of the refinement, each of which raises one cell's degree or halves it "
                 "along each axis, though the target has not been reached: 0 for the base cells alone. When left "
                 "out, no limit.",
         .minimum = 0,
         .maximum = kMostInt,
         .ending = Ending::steps}),
    member<&BuildOptions::strategy>(
        {.name = "strategy",
         .type = Type::choice,
         .help = "hp refines degree and depth; h1 and h2 are octrees of degree 1 or 2, for comparison.",
         .words = {"hp", "h1", "h2"},
         .storedAt = 6}),
    member<&BuildOptions::coefficients>(
        {.name = "coefficients",
         .type = Type::choice,
         .help = "Precision of the coefficients. auto takes float where that changes the error by less than 1 %.",
         .words = {"auto", "float", "double"}}),
    member<&BuildOptions::quadrature>(
        {.name = "quadrature",
         .type = Type::wholeNumber,
         .help = "Order of the quadrature as a multiple of the degree. The paper takes 4; 3 needs less than half of "
                 "the distances for the same error.",
         .minimum = 2,
         .maximum = 8,
         .storedAt = 5}),
    member<&BuildOptions::cubature>(
        {.name = "cubature",
         .type = Type::choice,
         .help = "Rule by which cells are sampled: compact needs half the points for the same order where such rules "
                 "are known (orders up to 13); product takes Gauss points along each axis, as the paper does.",
         .words = {"compact", "product"}}),
    member<&BuildOptions::trialSamples>(
        {.name = "trial-samples", .type = Type::choice, .words = {"children", "own"}, .isOffered = false}),
    member<&BuildOptions::band>({.name = "band",
                                 .help = "Width of a narrow band: cells farther from the surface than this are not "
                                         "refined and do not count. 0: no band.",
                                 .unit = "world units",
                                 .minimum = 0,
                                 .storedAt = 7}),
};

/// Changes to the finished octree, and the number of threads.
const std::vector<BuildSetting> kFinishing = {
    member<&BuildOptions::enrich>(
        {.name = "enrich",
         .type = Type::flag,
         .help = "Fit every cell anew at the end, one degree higher where max-degree allows: about twice the bytes, "
                 "with which weak continuity costs hardly any error.",
         .storedAt = 12,
         .key = "enriched"}),
    continuity({.name = "continuity",
                .type = Type::choice,
                .help =
                    "What is done about the jumps from cell to cell. weak lets the cells' polynomials give way to "
                    "each other at the end, so that the field jumps less for somewhat more error ('study continuity' "
                    "shows the trade). exact: value and gradient are continuous everywhere, neighbours being blended "
                    "in a thin zone along their faces; queries take up to twice as long. both: weak, then exact.",
                .words = {"none", "weak", "exact", "both"}}),
    member<&BuildOptions::continuityWeight>(
        {.name = "continuity-weight",
         .help = "λ of weak continuity: the cost of changing the field relative to that of its jumps. Small for "
                 "little jump, great for little error.",
         .minimum = 0,
         .maximum = kMaxContinuityWeight,
         .minimumExcluded = true,
         .fallback = {WeakContinuity{}.weight},
         .owner = "continuity weak",
         .hasOwner = [](const BuildOptions& options) { return options.continuityWeight.has_value(); },
         .storedAt = 13}),
    positiveMember<&BuildOptions::blend>(
        {.name = "blend-width",
         .help = "How wide the blended zones are on either side of a face, as a part of a cell's edges: the wider, "
                 "the gentler the gradients, and the slower the queries.",
         .minimum = 0,
         .maximum = kMaxBlend,
         .minimumExcluded = true,
         .fallback = {kDefaultBlend},
         .owner = "continuity exact",
         .hasOwner = [](const BuildOptions& options) { return options.blend > 0; },
         .key = "blend"}),
    member<&BuildOptions::bounds>(
        {.name = "bounds",
         .type = Type::flag,
         .help = "Keep for each cell a proven bound of its error, and of its slope. With them rays and collisions "
                 "miss nothing. They hold for closed meshes that do not intersect themselves."}),
    member<&BuildOptions::threads>({.name = "threads",
                                    .type = Type::wholeNumber,
                                    .help = "Threads to use; 0 for all. The field is the same whatever their number.",
                                    .minimum = 0,
                                    .maximum = 1024,
                                    .decides = false}),
};

/// Does not compile when `BuildOptions` gets a member more. Then the table needs another row, and this list a name.
[[maybe_unused]] void requireAllMembers(const BuildOptions& options) {
  [[maybe_unused]] const auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16, m17, m18, m19,
                                m20, m21, m22, m23] = options;
}

std::string numberText(double number) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.begin(), buffer.end(), number).ptr;
  std::string text(buffer.begin(), end);
  const std::size_t e = text.find('e');
  if (e != std::string::npos && text[e + 2] == '0') text.erase(e + 2, 1);  // 1e-06
  return text;
}

std::string valueText(const BuildSetting& setting, Values numbers) {
  if (setting.type == Type::choice) return std::string(setting.words.at(static_cast<std::size_t>(numbers[0])));
  if (setting.type == Type::flag) return numbers[0] != 0 ? "true" : "false";
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ",") + numberText(number);
  return text;
}

}  // namespace

std::span<const BuildSetting> buildSettings() {
  static const std::vector<BuildSetting> table = [] {
    std::vector<BuildSetting> all;
    for (const auto& part : {kGoals, kRefinement, kFinishing}) all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return table;
}

const BuildSetting& buildSetting(std::string_view name) {
  const auto found = std::ranges::find(buildSettings(), name, &BuildSetting::name);
  if (found == buildSettings().end()) throw std::logic_error("no setting '" + std::string(name) + "'");
  return *found;
}

std::string settingText(const BuildSetting& setting, const BuildOptions& options) {
  return valueText(setting, setting.get(options));
}

std::string defaultText(const BuildSetting& setting) {
  Numbers numbers = setting.get(BuildOptions{});
  if (numbers.empty()) numbers = setting.fallback;
  const bool allEqual = std::ranges::adjacent_find(numbers, std::ranges::not_equal_to()) == numbers.end();
  if (setting.type == Type::wholeNumbers && allEqual) numbers.resize(1);
  return valueText(setting, numbers);
}

BuildOptions storedSettings(const BuildOptions& options) {
  BuildOptions stored = FieldMetadata{}.settings;
  for (const BuildSetting& setting : buildSettings())
    if (setting.storedAt > 0) setting.set(stored, setting.get(options));
  return stored;
}

BuildOptions settingsOf(const FieldData& field) {
  BuildOptions settings = field.metadata.settings;
  settings.grid = field.grid;
  settings.blend = field.blend;
  settings.bounds = !field.bounds.empty();
  if (field.coefficients.index() == 0) settings.coefficients = CoefficientType::float64;
  return settings;
}

}  // namespace hpsdf
