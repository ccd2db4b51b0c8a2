// The panels of the explorer's right column.

#include "explorer/panels.h"
#include "explorer/worst_places.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/field.h"
#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kWorstRows = 8;
constexpr int kMostDecimals = 4;  // of coordinates in the list of worst interfaces

/// The kinds of levels that cells have.
enum class LevelKind : std::uint8_t { degree, depth };

/// The places in a panel that show the cells of one level when they are pressed.
struct LevelPlaces {
  const Controls& controls;
  const ViewState& view;
  std::string panel;
  LevelKind kind;

  /// Draws the place of a level at the present position. A press of a place whose cells are the ones that are shown
  /// hides them.
  void draw(int level, double width, double height) const {
    const std::string name = levelName(level), kindName = kind == LevelKind::degree ? "degree" : "depth";
    const std::vector<int>& shown = kind == LevelKind::degree ? view.cells.degrees : view.cells.depths;
    const std::vector<int>& others = kind == LevelKind::degree ? view.cells.depths : view.cells.degrees;
    const bool isShown = !view.slice && view.cells.style != render::CellStyle::none &&
                         shown == std::vector<int>{level} && others.empty();
    const auto style = view.cells.style == render::CellStyle::boxes ? "boxes" : "lines";
    const char* const otherKind = kind == LevelKind::degree ? "depth" : "degree";
    const std::string command = isShown ? "cells none degrees=all depths=all"
                                        : fmt::format("{}cells {} {}s={} {}s=all", view.slice ? "show surface ; " : "",
                                                      style, kindName, name, otherKind);
    controls.describe(command,
                      fmt::format("{} the cells of {} {}.", isShown ? "Hide" : "Show", kindName, name).c_str());
    if (controls.ui.place(panel + "/" + name, width, height, isShown)) controls.commands.push_back(command);
  }
};

void drawLevelSwatches(const std::vector<render::Legend::Level>& levels, const LevelPlaces& places) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float width = widthLeft() / float(std::max<std::size_t>(levels.size(), 1)), height = 20;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const float x0 = std::round(from.x + width * float(i)), x1 = std::round(from.x + width * float(i + 1));
    list.AddRectFilled({x0, from.y}, {x1, from.y + height}, packed(levels[i].color));
    const std::string label = levelName(levels[i].level);
    const bool dark = 2 * levels[i].color[0] + 5 * levels[i].color[1] + levels[i].color[2] < 4 * 255;
    if (widthOf(label) + 2 <= x1 - x0)
      textAt((x0 + x1 - widthOf(label)) / 2, from.y + 3, label, dark ? IM_COL32_WHITE : IM_COL32(20, 20, 30, 255));
    ImGui::SetCursorScreenPos({x0, from.y});
    places.draw(levels[i].level, x1 - x0, height);
  }
}

void drawColorBar(const render::Legend& legend) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float inset = 12, width = widthLeft() - 2 * inset, height = 16;
  for (int x = 0; x < int(width); ++x) {
    const auto& color = legend.bar[std::size_t(x) * (legend.bar.size() - 1) / std::size_t(width)];
    list.AddRectFilled({from.x + inset + float(x), from.y}, {from.x + inset + float(x) + 1, from.y + height},
                       packed(color));
  }
  float free = from.x;
  for (const auto& mark : legend.marks) {
    const float x = std::round(from.x + inset + float(mark.t) * (width - 1));
    list.AddRectFilled({x, from.y + height}, {x + 1, from.y + height + 4}, kTick);
    const float half = widthOf(mark.text) / 2, right = from.x + widthLeft();
    const float left = std::clamp(x - half, from.x, right - 2 * half);
    if (left < free) continue;
    textAt(left, from.y + height + 4, mark.text, kInk);
    free = left + 2 * half + 6;
  }
  ImGui::Dummy({widthLeft(), height + 20});
}

void drawSwatch(const render::Color& color, const std::string& name) {
  constexpr float kRow = 18, kSide = 10;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = ImGui::GetCursorScreenPos();
  list.AddRectFilled(from, {from.x + kSide, from.y + kSide}, kTick);
  list.AddRectFilled({from.x + 1, from.y + 1}, {from.x + kSide - 1, from.y + kSide - 1}, packed(color));
  textAt(from.x + kSide + 8, from.y - 2, name, kInk);
  ImGui::Dummy({widthLeft(), kRow});
}

/// Draws one column of a histogram, with its percentage above it and its level (a degree or depth) below it. `bottom`
/// is the position of the column's lower end and `bar` is its height, both in pixels.
void drawHistogramColumn(float x, float width, float bottom, float bar, ImU32 color, int level, double percent) {
  ImGui::GetWindowDrawList()->AddRectFilled({std::round(x) + 2, bottom - bar}, {std::round(x + width) - 2, bottom},
                                            color);
  const auto centered = [&](const std::string& text, float y, ImU32 ink) {
    if (widthOf(text) <= width) textAt(x + (width - widthOf(text)) / 2, y, text, ink);
  };
  const std::string share = percent < 0.1 ? "<.1" : fmt::format("{:.{}f}", percent, percent < 9.95 ? 1 : 0);
  centered(share, bottom - bar - ImGui::GetTextLineHeight(), kSoftInk);
  centered(levelName(level), bottom + 2, kInk);
}

/// Draws a histogram with one column for each level (a degree or depth). The column shows the level's share of the
/// volume. If `legend` is given, the columns have the colours of the legend. If `places` is given, the columns can be
/// pressed.
void drawHistogram(Ui& ui, const char* title, const std::map<int, double>& shares, const render::Legend* legend,
                   const std::optional<LevelPlaces>& places) {
  ui.text(title);
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float height = 36, line = ImGui::GetTextLineHeight(), whole = height + 2 * line + 2;
  const float width = std::min(44.0F, widthLeft() / float(std::max<std::size_t>(shares.size(), 1)));
  double greatest = 0;
  for (const auto& [level, share] : shares) greatest = std::max(greatest, share);
  float x = from.x;
  for (const auto& [level, share] : shares) {
    ImU32 color = IM_COL32(115, 148, 199, 255);
    if (legend != nullptr)
      for (const auto& known : legend->levels)
        if (known.level == level) color = packed(known.color);
    const float bar = std::max(1.0F, std::round(height * float(share / greatest)));
    drawHistogramColumn(x, width, from.y + line + height, bar, color, level, 100 * share);
    if (places) {
      ImGui::SetCursorScreenPos({x, from.y});
      places->draw(level, width, whole);
    }
    x += width;
  }
  ImGui::SetCursorScreenPos(from);
  ImGui::Dummy({widthLeft(), whole});
}

}  // namespace

void drawLegend(const Controls& controls, const Explorer& explorer) {
  const std::optional<render::Drawn>& picture = explorer.picture();
  if (!picture) return;
  Ui& ui = controls.ui;
  const render::Legend& legend = picture->legend;
  for (const auto& [name, count, color] : legend.defects) drawSwatch(color, name + ": " + count);
  for (const auto& [name, color] : legend.lines) drawSwatch(color, name);
  if (legend.title.empty()) {
    if (legend.defects.empty()) ui.text("only light: choose a colour on the left", true);
    return;
  }
  ui.text(legend.title);
  const ViewState& view = explorer.view();
  const LevelKind kind = view.colors().by == render::ColorBy::depth ? LevelKind::depth : LevelKind::degree;
  if (!legend.levels.empty()) drawLevelSwatches(legend.levels, {controls, view, "legend", kind});
  if (!legend.bar.empty()) drawColorBar(legend);
}

void drawHistograms(const Controls& controls, Explorer& explorer) {
  Ui& ui = controls.ui;
  const ViewState& view = explorer.view();
  const auto& picture = explorer.picture();
  const auto draw = [&](LevelKind kind, const std::map<int, double>& shares, bool takesPresses) {
    const bool isDegree = kind == LevelKind::degree;
    const auto colored = isDegree ? render::ColorBy::degree : render::ColorBy::depth;
    const std::string names = isDegree ? "degrees" : "depths";
    drawHistogram(ui, (names + ", % of the volume").c_str(), shares,
                  picture && view.colors().by == colored ? &picture->legend : nullptr,
                  takesPresses ? std::optional(LevelPlaces{controls, view, names, kind}) : std::nullopt);
  };
  const auto drawBoth = [&](const FieldStatistics& figures, bool takesPresses) {
    draw(LevelKind::degree, figures.degreeVolume, takesPresses);
    draw(LevelKind::depth, figures.depthVolume, takesPresses);
  };
  if (view.beside.empty()) return drawBoth(explorer.figures(), true);
  ui.text("left: " + currentName(explorer));
  drawBoth(explorer.figures(), true);
  if (!explorer.pictureBeside()) return;  // the other field has not been read yet
  ui.text("right: " + besideName(explorer));
  drawBoth(explorer.session().otherFigures(view.beside), false);
}

namespace {

using Facts = std::vector<std::pair<std::string, std::string>>;

/// Draws facts under a title, or nothing if there are none.
void drawFacts(Ui& ui, const char* title, const Facts& facts) {
  if (facts.empty()) return;
  ui.text(title);
  ui.facts(facts);
  ImGui::Dummy({0, 0.2F * ImGui::GetFontSize()});
}

Facts sizes(const FieldStatistics& figures) {
  Facts facts = {{"cells", grouped(figures.leaves)},
                 {"coefficients", grouped(figures.coefficients)},
                 {"memory", bytesText(double(figures.bytes))}};
  if (figures.exact.leaves > 0) {
    facts.emplace_back("exact cells", grouped(figures.exact.leaves));
    facts.emplace_back("exact triangles", grouped(figures.exact.triangles));
  }
  return facts;
}

Facts aims(const Field& field) {
  if (hasTolerance(field)) return {{"tolerance", shortNumber(field.metadata().settings.tolerance)}};
  if (!field.metadata().hasEstimate()) return {};
  return {{"target error τ", shortNumber(field.metadata().settings.targetError.weighted())},
          {"weighted estimate", shortNumber(field.metadata().totalError)}};
}

Facts measurements(const Field& field) {
  const std::optional<Measurement>& m = field.metadata().measurement;
  if (!m) return {};
  return {{"near the surface, RMS", shortNumber(m->near.rms)},
          {"near the surface, greatest", shortNumber(m->near.max)},
          {"whole domain, RMS", shortNumber(m->domain.rms)},
          {"whole domain, greatest", shortNumber(m->domain.max)},
          {"torn surface, %", shortNumber(100 * m->tornShare)}};
}

/// Returns what is known of a contour: how fine it is, and how far it and the surface are from each other.
Facts contourFacts(const Contour& contour) {
  Facts rows = {{"number", grouped(contour.mesh.triangles.size())},
                {"greatest gap to surface", shortNumber(contour.greatestValue)},
                {"greatest gap from surface", shortNumber(contour.greatestGap)}};
  if (contour.unresolved > 0) rows.emplace_back("places beyond the tolerance", grouped(contour.unresolved));
  if (contour.lostParts > 0) rows.emplace_back("cells with lost parts", grouped(contour.lostParts));
  return rows;
}

/// Draws a table of statistics of a field. `jumps` is null while the jumps of the field are unknown, and `contour` is
/// null if the picture shows none.
void drawStatisticsOf(Ui& ui, const Field& field, const FieldStatistics& figures, const Jumps* jumps,
                      const Contour* contour) {
  drawFacts(ui, "Size", sizes(figures));
  drawFacts(ui, "Asked for, and estimated", aims(field));
  drawFacts(ui, "Measured error", measurements(field));
  if (jumps != nullptr)
    drawFacts(ui, "Jumps between cells, RMS",
              {{"of f", shortNumber(jumps->value.rms)}, {"of its gradient", shortNumber(jumps->gradient.rms)}});
  if (contour != nullptr) drawFacts(ui, "Triangles", contourFacts(*contour));
}

/// Returns how many decimals tell apart places that are a thousandth of the domain apart.
int decimalsFor(const Box& domain) {
  return std::clamp(2 - int(std::floor(std::log10(domain.sizes().maxCoeff()))), 0, 9);
}

}  // namespace

void drawStatistics(Ui& ui, Explorer& explorer) {
  Session& session = explorer.session();
  const std::string& beside = explorer.view().beside;
  if (!beside.empty()) ui.text("left: " + currentName(explorer));
  drawStatisticsOf(ui, session.current().field, explorer.figures(), session.knowsJumps() ? &session.jumps() : nullptr,
                   explorer.shownContour());
  if (beside.empty() || !explorer.pictureBeside()) return;
  ui.text("right: " + besideName(explorer));
  const Session::Other& other = session.other(beside);
  drawStatisticsOf(ui, other.field, session.otherFigures(beside), other.jumps ? &*other.jumps : nullptr, nullptr);
}

void drawWorst(const Controls& controls, Explorer& explorer) {
  if (!explorer.session().knowsJumps()) return;  // do not wait for jumps that are still being measured
  const ViewState& view = explorer.view();
  const Jumps& jumps = explorer.session().jumps();
  controls.choice("worst/by", "jump of", {"value", "gradient"}, view.worstBy == JumpKind::value ? "value" : "gradient",
                  "worst by=");
  controls.choice("worst/on", "places", {"all", "surface"}, view.worstOnSurface ? "surface" : "all", "worst on=");
  const Field& field = explorer.session().current().field;
  const std::size_t first = std::size_t(view.worstPage) * kWorstRows;
  const auto& worst = explorer.worst(first + kWorstRows + 1);  // one more tells whether there is a next page
  const std::size_t last = std::min(worst.size(), first + kWorstRows);
  const int decimals = decimalsFor(field.domain());
  // Coordinates of very small domains would have more digits than there is room for.
  const auto coordinate = [&](double value) {
    return decimals <= kMostDecimals ? fmt::format("{:.{}f}", value, decimals) : fmt::format("{:.2g}", value);
  };
  for (std::size_t rank = first; rank < last; ++rank) {
    const Interface& face = jumps.interfaces[worst[rank]];
    const Vector3& x = face.worst;
    const std::array cells = {fmt::format("{}.", rank + 1), shortNumber(jumpOf(face, view.worstBy).max),
                              std::string(isTorn(field, face) ? "torn" : ""),
                              fmt::format("{}, {}, {}", coordinate(x.x()), coordinate(x.y()), coordinate(x.z()))};
    constexpr std::array kColumns = {0.0, 3.0, 11.5, 15.5};
    const std::string fly = fmt::format("fly {}", rank + 1);
    // The shortest numbers that are read back as the same floats: they can be typed after 'fly to='.
    controls.describe(
        fly,
        fmt::format("Take a close look at this place:\n{},{},{}", float(x.x()), float(x.y()), float(x.z())).c_str());
    if (controls.ui.row(fmt::format("worst/{}", rank - first + 1), cells, kColumns)) controls.commands.push_back(fly);
  }
  const auto page = [](int number) { return fmt::format("worst page={}", number); };
  controls.button("worst/previous", fmt::format("previous {}", kWorstRows).c_str(), page(view.worstPage).c_str(),
                  view.worstPage > 0, "Turn back to the places before these.");
  ImGui::SameLine();
  controls.button("worst/next", fmt::format("next {}", kWorstRows).c_str(), page(view.worstPage + 2).c_str(),
                  last < worst.size(), "Turn to the places that follow.");
}

}  // namespace hpsdf::app
