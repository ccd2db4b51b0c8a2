#include "hpsdf/detail/build_settings.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <type_traits>

namespace hpsdf {
namespace {

using namespace setting_group;
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
    else  // convert via 64 bits, which hold every number that a damaged file can contain
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

/// The type, the range, the unit and other properties of a setting. The setting's row in the table of settings adds the
/// name, the help text and the access to the value.
struct Kind : BuildSetting {
  Kind& atLeast(double limit) { return with(minimum, limit); }
  Kind& above(double limit) { return atLeast(limit).with(minimumExcluded, true); }
  Kind& atMost(double limit) { return with(maximum, limit); }
  Kind& within(double least, double most) { return atLeast(least).atMost(most); }
  Kind& in(std::string_view nameOfUnit) { return with(unit, nameOfUnit); }
  Kind& byDefault(double value) { return with(fallback, {value}); }
  Kind& ends(Ending manner) { return with(ending, manner); }
  Kind& insteadOf(std::string_view other) { return with(exclusive, other); }
  Kind& of(std::string_view other, bool (*isOn)(const BuildOptions&)) {
    return with(owner, other).with(hasOwner, isOn);
  }
  Kind& stored(int position) { return with(storedAt, position); }
  Kind& inJson(std::string_view nameInJson) { return with(key, nameInJson); }
  Kind& advanced() { return with(isAdvanced, true); }
  Kind& undeciding() { return with(decides, false); }
  Kind& orShare() { return with(mayBeShare, true); }
  Kind& suitsTolerance() { return with(hasEffectWithTolerance, true); }
  Kind& hidden() { return with(isOffered, false); }

 private:
  template <typename T>
  Kind& with(T& value, std::type_identity_t<T> changed) {
    value = std::move(changed);
    return *this;
  }
};

Kind number() { return {}; }
Kind wholeNumber() { return {{.type = Type::wholeNumber}}; }
Kind wholeNumbers() { return {{.type = Type::wholeNumbers}}; }
Kind flag() { return {{.type = Type::flag}}; }
Kind choice(std::vector<std::string_view> words) { return {{.type = Type::choice, .words = std::move(words)}}; }

/// Functions that read and change the value of one setting.
struct Access {
  bool isChecked;
  Numbers (*get)(const BuildOptions&);
  void (*set)(BuildOptions&, Values);
};

/// Functions that read and change one member of `BuildOptions`.
template <auto kMember, typename M = Member<std::remove_reference_t<decltype(std::declval<BuildOptions>().*kMember)>>>
constexpr Access member = {M::isChecked, [](const BuildOptions& options) { return M::get(options.*kMember); },
                           [](BuildOptions& options, Values numbers) { M::set(options.*kMember, numbers); }};

/// Returns a list with the value as its only number, or an empty list if the value is 0. The value 0 stands for an
/// unset setting.
Numbers unlessZero(double value) { return value == 0 ? Numbers{} : Numbers{value}; }

/// Functions that read and change a member of `BuildOptions` that is unset if it is 0.
template <auto kMember>
constexpr Access positive = {true, [](const BuildOptions& options) { return unlessZero(options.*kMember); },
                             member<kMember>.set};

/// Functions that read and change a member of `NearFarError`, the target errors near the surface and far from it.
/// The member is unset if it is 0.
template <auto kMember>
constexpr Access nearFar = {
    true, [](const BuildOptions& options) { return unlessZero(options.targetError.byDistance().*kMember); },
    [](BuildOptions& options, Values numbers) {
      NearFarError error = options.targetError.byDistance();
      error.*kMember = numbers.empty() ? 0 : numbers[0];
      options.targetError = error;
    }};

constexpr Access kWeightedError = {
    true, [](const BuildOptions& options) { return unlessZero(options.targetError.weighted()); },
    [](BuildOptions& options, Values numbers) { options.targetError = numbers.empty() ? 0 : numbers[0]; }};

/// The setting that chooses weak and exact continuity. Its value is an index into the list of words none, weak, exact,
/// both. In this index, bit 0 stands for weak and bit 1 for exact continuity.
constexpr Access kContinuity = {
    false,
    [](const BuildOptions& options) {
      return Numbers{(options.continuityWeight ? 1.0 : 0.0) + (options.blend > 0 ? 2.0 : 0.0)};
    },
    [](BuildOptions& options, Values numbers) {
      const int kinds = static_cast<int>(numbers[0]);
      options.continuityWeight.reset();
      if ((kinds & 1) != 0) options.continuityWeight = WeakContinuity{}.weight;
      options.blend = (kinds & 2) != 0 ? kDefaultBlend : 0;
    }};

bool isTolerant(const BuildOptions& options) { return options.tolerance > 0; }
bool isByDistance(const BuildOptions& options) { return options.targetError.byDistance().near > 0; }
bool isSmoothed(const BuildOptions& options) { return options.continuityWeight.has_value(); }
bool isBlended(const BuildOptions& options) { return options.blend > 0; }

struct Row : BuildSetting {
  Row(std::string_view itsName, std::string_view itsGroup, const Kind& kind, const Access& access,
      std::string_view itsHelp)
      : BuildSetting(kind) {
    name = itsName;
    group = itsGroup;
    help = itsHelp;
    isChecked = access.isChecked;
    get = access.get;
    set = access.set;
  }
};

const std::vector<Row> kRows = {
    // settings for the goal of the construction and for its limit of bytes
    {"tolerance", kAsked,
     number()
         .above(0)
         .in("world units, or % of the mesh's longest side")
         .orShare()
         .ends(Ending::tolerance)
         .insteadOf("target-error")
         .suitsTolerance()
         .stored(17),
     positive<&BuildOptions::tolerance>,
     "Greatest error of the distance near the surface: 0.01, or 0.02% of the mesh's longest side. It holds up to "
     "the distance 'within' from the surface; beyond it, 1 % of the further distance is allowed in addition, so that "
     "the sign is "
     "right wherever the distance exceeds the tolerance. Polynomials, exact cells and precision follow: the "
     "construction seeks those that take the fewest bytes. The error is checked in every cell and measured at the "
     "end."},
    {"within", kAsked,
     number()
         .above(0)
         .in("world units, or % of the mesh's longest side")
         .orShare()
         .of("tolerance", isTolerant)
         .suitsTolerance()
         .stored(18),
     positive<&BuildOptions::within>,
     "Distance from the surface up to which the tolerance holds. When left out, 5 % of the mesh's longest side."},
    {"certified", kAsked, flag().of("tolerance", isTolerant).suitsTolerance().stored(19),
     member<&BuildOptions::certified>,
     "Takes only polynomials whose errors are proven to be within the tolerance at every point, not only at those that "
     "are checked. It takes longer and gives a larger field. It needs a mesh without holes, and the "
     "automatic inside test or the one by winding numbers."},
    {"target-error", kAsked, number().above(0).in("units^5 at that scale").ends(Ending::target).stored(1),
     kWeightedError,
     "τ, the weighted squared error to reach, for a mesh whose longest side is 2; internally τ·(L/2)^5, where L is "
     "that side in mesh units, so that the same τ gives the same cells in any unit. Smaller is more exact."},
    {"grid", kMethod, wholeNumbers().within(1, kMostInt).suitsTolerance(), member<&BuildOptions::grid>,
     "Base cells an axis: one number for all, or NX,NY,NZ."},
    {"nearness", kMethod, number().within(0, 1000).stored(2).advanced(), member<&BuildOptions::nearness>,
     "θ: how much more an error counts near the surface than far away; 0 weighs all cells alike."},
    {"nearness-kind", kMethod, choice({"polynomial", "exponential"}).stored(10).advanced(),
     member<&BuildOptions::nearnessKind>,
     "How an error's weight falls with the distance s, where d is the domain's diagonal: polynomial, (1 − s/d)^θ, as "
     "in the paper, or exponential, exp(−θ s/d), which goes on falling far away."},
    {"near-error", kAsked, number().above(0).in("world units").ends(Ending::byDistance).insteadOf("target-error"),
     nearFar<&NearFarError::near>,
     "RMS error to reach near the surface, with far-error, in place of target error and nearness, which then follow, "
     "nearness by its exponential kind. By the estimate: 'hpsdf verify' measures what came of it."},
    {"far-error", kAsked, number().above(0).in("world units").ends(Ending::byDistance).insteadOf("target-error"),
     nearFar<&NearFarError::far>, "RMS error to reach farther away than near-distance, with near-error; not below it."},
    {"near-distance", kAsked, number().above(0).in("world units").of("near-error", isByDistance).advanced(),
     nearFar<&NearFarError::nearDistance>,
     "Distance up to which near-error holds. When left out, a hundredth of the mesh's longest side."},
    {"max-error", kAsked, number().above(0).in("world units").ends(Ending::otherQuantity).stored(11),
     positive<&BuildOptions::maxError>,
     "Error to be exceeded nowhere (within the band, if there is one): after the target, if one is given, every cell "
     "is probed at 512 points and refined where the error is greater. Expensive; takes no target error unless one is "
     "given."},
    {"max-bytes", kAsked, wholeNumber().within(1, kMostBytes).in("bytes").ends(Ending::otherQuantity).stored(22),
     member<&BuildOptions::maxBytes>,
     "The best field of at most so many bytes of memory, e.g. 4e6. Takes no target error unless one is given; with "
     "max-error it ends where that is reached."},
    {"memory-limit", kMethod, wholeNumber().within(1, kMostBytes).in("bytes").undeciding().suitsTolerance().advanced(),
     member<&BuildOptions::memoryLimit>,
     "Memory that the construction may take, the mesh's exact distance included. Where more will be needed it stops as "
     "soon as that is certain, and tells how much. Weak continuity's solver takes about 50 bytes a coefficient on top, "
     "and a hull's pieces 80 MB at most. Left out: 1e8 besides that distance, some 240,000 cells, where target error, "
     "grid and max-steps are left out too; most meshes take less than 100,000 then. Else three quarters of the "
     "machine's memory, or of what its control group allows."},
    // settings for the refinement of cells
    {"estimator", kMethod, choice({"embedded", "residual", "checked"}).stored(8).advanced(),
     member<&BuildOptions::estimator>,
     "What estimates a cell's error: embedded, the coefficients of the top degree, as in the paper; residual, the "
     "part of its samples that the fit does not represent; or checked, the residual and the error at points that are "
     "no samples, so that edges and medial surfaces between the samples are not missed. Only checked evaluates the "
     "distance, for some 5 % more distances a trial."},
    {"criterion", kMethod, choice({"paper", "optimal"}).stored(9), member<&BuildOptions::criterion>,
     "How degrees and depths are chosen. paper: step by step, by the gain a coefficient. optimal: a little farther "
     "than needed, then back where that saves most bytes for the error: about half of the coefficients at equal error, "
     "for 1.3 times the distances."},
    {"max-degree", kMethod, wholeNumber().within(1, kMaxDegree).stored(3).advanced(), member<&BuildOptions::maxDegree>,
     "Highest degree of a cell's polynomial."},
    {"max-depth", kMethod, wholeNumber().within(0, kMaxDepth).stored(4).advanced(), member<&BuildOptions::maxDepth>,
     "How often a base cell may be halved."},
    {"max-steps", kAsked, wholeNumber().within(0, kMostInt).ends(Ending::steps).advanced(),
     member<&BuildOptions::maxSteps>,
     "End after so many steps of the refinement, each of which raises one cell's degree or halves it along each axis, "
     "though the target has not been reached: 0 for the base cells alone. When left out, no limit."},
    {"strategy", kMethod, choice({"hp", "h1", "h2", "hpx", "auto"}).stored(6).advanced(),
     member<&BuildOptions::strategy>,
     "How cells are refined. hp raises a cell's degree or divides the cell. hpx first makes the cells near the surface "
     "exact: instead of a polynomial they keep the triangles nearest to them. Use hpx where the surface itself must be "
     "right, with its sharp edges and thin walls, which polynomials only approximate; queries of exact cells take "
     "longer. It needs a mesh; for analytic:SHAPE it is hp. h1 and h2 only divide cells, all of degree 1 or 2, for "
     "comparison. auto takes hpx for meshes with sharp edges or coarse facets, and hp for smooth or very fine ones."},
    {"exact-within", kResult, number().within(0, 1).in("multiples of the mesh's longest side").stored(14).advanced(),
     member<&BuildOptions::exactWithin>,
     "Distance from the surface up to which a field of strategy hpx is exact. Raise it where bodies sink in deeper or "
     "surfaces at an offset must be exact; lower it for a smaller field. With 0, only the cells "
     "through which the surface passes are exact."},
    {"exact-tolerance", kResult, number().within(0, 1).in("multiples of the mesh's longest side").stored(16).advanced(),
     member<&BuildOptions::exactTolerance>,
     "Error that a field of strategy hpx may have near the surface where the surface is smooth: a cell takes a "
     "polynomial instead of triangles if its error at 512 points does not exceed this. Raise it, for instance to 1e-5, "
     "for finely divided smooth meshes. With 0, cells near the surface take a polynomial only where the surface is "
     "plane."},
    {"exact-triangles", kMethod, wholeNumber().within(1, 4096).stored(15).advanced(),
     member<&BuildOptions::exactTriangles>,
     "Number of triangles above which an exact cell of strategy hpx is divided, down to max-depth. Up to twice as many "
     "stay together where dividing would hardly shorten the list. Raise it for fewer cells and a smaller field, lower "
     "it for faster queries."},
    {"coefficients", kResult, choice({"auto", "float", "double", "quantized"}).suitsTolerance().advanced(),
     member<&BuildOptions::coefficients>,
     "Precision of the coefficients. quantized, which auto takes, stores integers of few bits: a quarter to a half of "
     "the bytes of float. That raises the RMS error over the domain by about 0.5 %, changes the field nowhere by more "
     "than 1 % of max-error or 5 % of the tolerance, and keeps a field of strategy hpx exact within exact-within; a "
     "limit of bytes may demand more. Where integers would be too long, auto takes float or double, and quantized "
     "float. Take float or double for fields whose coefficients other programs read."},
    {"quadrature", kMethod, wholeNumber().within(2, 8).stored(5).advanced(), member<&BuildOptions::quadrature>,
     "Order of the quadrature as a multiple of the degree. The paper takes 4; 3 needs less than half of the distances "
     "for the same error."},
    {"cubature", kMethod, choice({"compact", "product", "gradients"}).stored(20).advanced(),
     member<&BuildOptions::cubature>,
     "Rule by which cells are sampled: product takes Gauss points along each axis, as the paper does; compact needs "
     "half the points for the same order where such rules are known (orders up to 13); gradients takes the distance "
     "and its gradient at still fewer points, for degrees 2 to 5, and is compact for other degrees, for "
     "analytic:SHAPE, "
     "for outer hulls, for holes that winding numbers close and for the estimator embedded."},
    {"trial-samples", kMethod, choice({"children", "own"}).stored(21).hidden(), member<&BuildOptions::trialSamples>,
     ""},
    {"band", kResult, number().atLeast(0).in("world units").stored(7).advanced(), member<&BuildOptions::band>,
     "Width of a narrow band: cells farther from the surface than this are not refined and do not count. 0: no band."},
    // settings for changes to the finished octree and for the number of threads
    {"enrich", kMethod, flag().stored(12).inJson("enriched").advanced(), member<&BuildOptions::enrich>,
     "Fit every cell anew at the end, one degree higher where max-degree allows: about twice the bytes, with which "
     "weak continuity costs hardly any error."},
    {"continuity", kResult, choice({"none", "weak", "exact", "both"}).suitsTolerance(), kContinuity,
     "What is done about the jumps from cell to cell. weak lets the cells' polynomials give way to each other at the "
     "end, so that the field jumps less for somewhat more error ('study continuity' shows the trade). exact: value and "
     "gradient are continuous everywhere, neighbours being blended in a thin zone along their faces; queries take up "
     "to twice as long. both: weak, then exact."},
    {"continuity-weight", kResult,
     number()
         .above(0)
         .atMost(kMaxContinuityWeight)
         .byDefault(WeakContinuity{}.weight)
         .of("continuity weak", isSmoothed)
         .stored(13)
         .advanced(),
     member<&BuildOptions::continuityWeight>,
     "λ of weak continuity: the cost of changing the field relative to that of its jumps. Small for little jump, great "
     "for little error."},
    {"blend-width", kResult,
     number()
         .above(0)
         .atMost(kMaxBlend)
         .byDefault(kDefaultBlend)
         .of("continuity exact", isBlended)
         .suitsTolerance()
         .inJson("blend")
         .advanced(),
     positive<&BuildOptions::blend>,
     "How wide the blended zones are on either side of a face, as a part of a cell's edges: the wider, the gentler the "
     "gradients, and the slower the queries."},
    {"bounds", kResult, flag().suitsTolerance(), member<&BuildOptions::bounds>,
     "Keep for each cell a proven bound of its error, and of its slope. With them rays and collisions miss nothing. "
     "They hold for closed meshes that do not intersect themselves."},
    {"threads", "General", wholeNumber().within(0, 1024).undeciding().suitsTolerance(), member<&BuildOptions::threads>,
     "Threads to use; 0 for all. The field is the same whatever their number."},
};

/// Fails to compile if `BuildOptions` gets another member. In that case, add a row to the table of settings and
/// a name to the list of members here.
[[maybe_unused]] void requireAllMembers(const BuildOptions& options) {
  [[maybe_unused]] const auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16, m17, m18, m19,
                                m20, m21, m22, m23, m24, m25, m26, m27, m28, m29] = options;
}

std::string numberText(double number) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.begin(), buffer.end(), number).ptr;
  std::string text(buffer.begin(), end);
  const std::size_t e = text.find('e');
  if (e != std::string::npos && text[e + 2] == '0') text.erase(e + 2, 1);  // shorten 1e-06 to 1e-6
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
  static const std::vector<BuildSetting> table(kRows.begin(), kRows.end());
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
  const std::array kTypes = {CoefficientType::float64, CoefficientType::float32, CoefficientType::quantized};
  settings.coefficients = kTypes[field.coefficients.index()];
  return settings;
}

}  // namespace hpsdf
