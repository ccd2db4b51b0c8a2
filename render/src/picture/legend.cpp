#include "picture/legend.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coloring/color_view.h"

namespace hpsdf::render {
namespace {

constexpr Color kShareBar = {206, 209, 218};

// The text size for a picture: 15 pixels at 1280 × 720. It is proportional to the size of larger pictures, and shrinks
// less than in proportion for smaller ones.
double textSizeFor(int width, int height) {
  const double size = std::min<double>(height, width * 9.0 / 16);
  return size >= 720 ? 15 * size / 720 : std::max(9.0, 15 - (720 - size) * 5 / 480);
}

// The part of the legend's panel that is still free below the title.
struct Column {
  /// Adds a title to the overlay: the first of `titles` that fits into the panel.
  Column(Overlay& overlay, const Frame& frame, std::span<const std::string> titles)
      : left(frame.panel.x0 + frame.textSize),
        right(frame.panel.x1 - frame.textSize),
        top(frame.panel.y0 + frame.textSize),
        bottom(frame.panel.y1 - 0.5 * frame.textSize) {
    const double em = frame.textSize;
    addText(overlay, fittingTitle(titles, em, width()), em, left, top + capHeight(em), kInk);
    top += 1.7 * em;
  }

  double width() const { return right - left; }

  double left, right, top, bottom;
};

// The position of a vertical colour bar in the panel, and of the numbers beside it.
struct Bar {
  double left, right, top, bottom;
  double labelsLeft, labelsRight;  // extent of the numbers beside the bar
  double labelSize;
  double height() const { return bottom - top; }
};

// Adds a title and a colour bar, with the map's colour of 1 at the top and of 0 at the bottom.
Bar addBar(Overlay& overlay, const Frame& frame, std::span<const std::string> titles, double above, double below,
           const ColorMap& map) {
  const double em = frame.textSize;
  const Column column(overlay, frame, titles);
  const double left = std::round(column.left), right = left + std::round(1.7 * em);
  const Bar bar{.left = left,
                .right = right,
                .top = std::round(column.top + above),
                .bottom = std::round(column.bottom - below),
                .labelsLeft = right + 0.6 * em,
                .labelsRight = column.right,
                .labelSize = std::min(em, 0.9 * em + 1)};
  // Each row reaches down to the end of the bar, and the next one covers the rest: between rows that only touch, an
  // enlarged picture would show the paper.
  for (double y = bar.top; y < bar.bottom; ++y)
    overlay.boxes.push_back(
        {bar.left, y, bar.right, bar.bottom, encodeSrgb(map.at((bar.bottom - y - 0.5) / bar.height()))});
  return bar;
}

// Adds a number beside the colour bar if the whole number fits, because a part of a number would mislead.
// Returns true if it fits.
bool addBarLabel(Overlay& overlay, const Bar& bar, const std::string& label, double y) {
  const bool fits = bar.labelsLeft + advanceOf(label, bar.labelSize) <= bar.labelsRight;
  if (fits) addText(overlay, label, bar.labelSize, bar.labelsLeft, y + capHeight(bar.labelSize) / 2, kInk);
  return fits;
}

struct LevelRow {
  int level;
  double share;
  double top, height;
  double baseline(double size) const { return top + (height + capHeight(size)) / 2; }
};

void addSwatch(Overlay& overlay, const LevelRow& row, double left, double width, double gap, Color color) {
  overlay.boxes.push_back({left, std::round(row.top), left + width, std::round(row.top + row.height - gap), color});
}

// Returns the size of a level's name. The word for exact leaves is longer than a number, and smaller where there is
// little room.
double nameSize(int level, double size, bool roomy) {
  return roomy || level != kExactDegree ? size : std::max(kSmallestText, 0.72 * size);
}

// Returns the width of the swatches in which the levels' names stand.
double swatchWidth(const std::map<int, double>& shares, double size, bool roomy) {
  const double forNumber = 2.1 * size;
  if (!shares.contains(kExactDegree)) return std::round(forNumber);
  const double forWord = advanceOf(levelName(kExactDegree), nameSize(kExactDegree, size, roomy));
  return std::round(std::max(forNumber, forWord + (roomy ? 0.5 : 0.2) * size));
}

// Adds a row for a level: a swatch with the level's name, and the level's share of the volume as text. In a roomy
// picture, a grey bar shows the share too.
void addWideRow(Overlay& overlay, const Column& column, const LevelRow& row, double size, double swatch,
                double largestShare, bool roomy) {
  const double left = std::round(column.left);
  const double gap = std::max(1.0, std::round(0.16 * row.height));
  addSwatch(overlay, row, left, swatch, gap, levelColor(row.level));
  LevelRow box = row;
  box.height -= gap;
  const std::string name = levelName(row.level);
  const double baseline = std::round(box.baseline(size)), ofName = nameSize(row.level, size, roomy);
  addText(overlay, name, ofName, left + (swatch - advanceOf(name, ofName)) / 2, std::round(box.baseline(ofName)),
          inkOn(decodeSrgb(levelColor(row.level))));

  const double shareRight = left + swatch + 0.5 * size + advanceOf("99.9 %", size);
  if (shareRight > column.right) return;
  const std::string share = formatShare(row.share);
  addText(overlay, share, size, shareRight - advanceOf(share, size), baseline, kInk);
  const double barLeft = shareRight + 0.6 * size;
  if (!roomy || barLeft + size > column.right) return;
  const double middle = box.top + box.height / 2, half = std::max(1.0, 0.22 * size);
  overlay.boxes.push_back({barLeft, middle - half, barLeft + (column.right - barLeft) * row.share / largestShare,
                           middle + half, kShareBar});
}

// Adds one row per level, for a legend of so many levels that the rows are too low for a text in each row. The swatches
// touch, and only some of them have the level's number beside them.
void addNarrowRows(Overlay& overlay, const Column& column, const std::vector<LevelRow>& rows) {
  const double left = std::round(column.left), swatch = std::round(0.35 * column.width());
  const double size = std::min(kSmallestText + 1, 1.1 * kSmallestText);
  double lastTop = -1e9;
  for (const LevelRow& row : rows) {
    addSwatch(overlay, row, left, swatch, 0, levelColor(row.level));
    const double baseline = std::round(row.baseline(size));
    if (baseline - capHeight(size) < lastTop + 1.5 * size || baseline > column.bottom) continue;
    if (baseline - capHeight(size) < column.top) continue;
    addText(overlay, levelName(row.level), size, left + swatch + 0.5 * size, baseline, kInk);
    lastTop = baseline - capHeight(size);
  }
}

std::string withoutTrailingZeros(std::string number) {
  if (number.find('.') != std::string::npos) number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  return number;
}

// Formats a positive number without padding: 1.5e-7, not 1.500e-07.
std::string formatScientific(double value, int digits) {
  const std::string shown = printed("%.*e", digits - 1, value);
  const std::size_t e = shown.find('e');
  return withoutTrailingZeros(shown.substr(0, e)) + "e" + std::to_string(std::stoi(shown.substr(e + 1)));
}

// Formats a positive number without an exponent or trailing zeros, rounded to `digits` digits, or to a whole number if
// its integer part has more digits.
std::string formatPlain(double value, int digits) {
  const int beforePoint = static_cast<int>(std::floor(std::log10(value))) + 1;
  return withoutTrailingZeros(printed("%.*f", std::max(0, digits - beforePoint), value));
}

// Formats a multiple of a step with its sign. All multiples have the same number of decimals, or an exponent if the
// step is very small or very large.
std::string formatTick(double value, double step) {
  if (value == 0) return "0";
  const std::string sign = value < 0 ? "−" : "+";
  if (step < 0.9e-3 || step > 0.9e4) return sign + formatScientific(std::abs(value), 3);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  return sign + printed("%.*f", decimals, std::abs(value));
}

// Adds an arrow from (x, y) to the right or upwards.
void addArrow(Overlay& overlay, double x, double y, double length, double thin, bool upwards) {
  const auto box = [&](double from, double to, double half) {
    const double middle = 0.5 * thin;
    if (upwards)
      overlay.boxes.push_back({x + middle - half, y - to, x + middle + half, y - from, kSoftInk});
    else
      overlay.boxes.push_back({x + from, y + middle - half, x + to, y + middle + half, kSoftInk});
  };
  const double head = 4.5 * thin;
  box(0, length - head, 0.5 * thin);
  for (double back = 0; back < head; back += 0.5 * thin)
    box(length - back - 0.5 * thin, length - back, 0.45 * (back + 0.5 * thin));
}

void blendBox(Image& image, const BoxItem& box) {
  const auto overlap = [](double low, double high, int pixel) {
    return std::clamp(std::min(high, pixel + 1.0) - std::max(low, double(pixel)), 0.0, 1.0);
  };
  const LinearColor color = decodeSrgb(box.color);
  for (int y = std::max(0, int(std::floor(box.y0))); y < std::min<double>(image.height, std::ceil(box.y1)); ++y)
    for (int x = std::max(0, int(std::floor(box.x0))); x < std::min<double>(image.width, std::ceil(box.x1)); ++x) {
      const double covered = overlap(box.x0, box.x1, x) * overlap(box.y0, box.y1, y);
      if (covered >= 1)
        image.at(x, y) = box.color;
      else
        mixInto(image.at(x, y), color, float(covered));
    }
}

}  // namespace

Color inkOn(const LinearColor& ground) {
  return toOklab(ground).lightness > 0.64 ? Color{20, 20, 30} : Color{255, 255, 255};
}

void addText(Overlay& overlay, std::string text, double size, double x, double baseline, Color color) {
  if (!text.empty()) overlay.texts.push_back({std::move(text), size, x, baseline, color});
}

std::string fittingTitle(std::span<const std::string> titles, double size, double width) {
  for (const std::string& title : titles)
    if (advanceOf(title, size) <= width) return title;
  return fitText(titles.back(), size, width);
}

Frame frame(int width, int height) {
  Frame f;
  f.width = width;
  f.height = height;
  f.textSize = textSizeFor(width, height);
  f.roomy = std::min<double>(height, width * 9.0 / 16) >= 440;
  const bool hasPanel = width >= 200 && height >= 140;
  const bool hasCaption = width >= 160 && height >= 140;
  const int panel = hasPanel ? static_cast<int>(std::lround((f.roomy ? 13.5 : 8.4) * f.textSize)) : 0;
  const int caption = hasCaption ? static_cast<int>(std::lround(2.4 * f.textSize)) : 0;
  f.view = {0, 0, width - panel, height - caption};
  if (hasPanel) f.panel = {width - panel, 0, width, height - caption};
  if (hasCaption) f.caption = {0, height - caption, width, height};
  return f;
}

void addLevelLegend(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                    const std::map<int, double>& shares) {
  if (frame.panel.empty() || shares.empty()) return;
  const double em = frame.textSize;
  Column column(overlay, frame, titles);
  if (frame.roomy) {
    const double small = 0.8 * em;
    addText(overlay, fitText("share of the volume", small, column.width()), small, column.left,
            column.top - 0.35 * em + capHeight(small), kSoftInk);
    column.top += 1.2 * em;
  }

  const double height = std::min(1.75 * em, (column.bottom - column.top) / double(shares.size()));
  const double size = std::min(em, 0.74 * height);
  double largestShare = 0;
  std::vector<LevelRow> rows;
  for (auto level = shares.rbegin(); level != shares.rend(); ++level) {
    rows.push_back({level->first, level->second, column.top + height * double(rows.size()), height});
    largestShare = std::max(largestShare, level->second);
  }
  if (size < kSmallestText) return addNarrowRows(overlay, column, rows);
  const double swatch = swatchWidth(shares, size, frame.roomy);
  for (const LevelRow& row : rows) addWideRow(overlay, column, row, size, swatch, largestShare, frame.roomy);
}

void addDistanceBar(Overlay& overlay, const Frame& frame, const DistanceScale& scale, const ColorMap& map) {
  if (frame.panel.empty()) return;
  const double em = frame.textSize, thin = std::max(1.0, em / 15);
  static const std::string titles[] = {"signed distance", "distance"};
  const Bar bar = addBar(overlay, frame, titles, 0.3 * em, 0.6 * em, map);

  // Choose the iso-lines that get numbers: zero and every 1st, 2nd, 5th, 10th … line from zero, so that the
  // numbers have room.
  const double perLine = bar.height() * scale.step / (2 * scale.range);
  const int lines = static_cast<int>(std::floor(scale.range / scale.step + 1e-9));  // above zero, about 1e7 at most
  int every = 1;
  for (int decade = 1; every * perLine < 1.7 * bar.labelSize && every <= lines; decade *= 10)
    for (const int digit : {2, 5, 10})
      if (every * perLine < 1.7 * bar.labelSize) every = digit * decade;

  // Leave out the iso-lines without numbers if they are so dense that they would cover the colours.
  const int next = perLine < 2 * thin ? every : 1;
  for (int line = -(lines / next) * next; line <= lines; line += next) {
    const double y = bar.top + bar.height() * (0.5 - 0.5 * (line * scale.step) / scale.range);
    const double half = line == 0 ? 1.2 * thin : 0.5 * thin;
    const bool labelled = line % every == 0;
    overlay.boxes.push_back({bar.left, y - half, bar.right + (labelled ? 0.35 * em : 0), y + half, kTick});
    if (labelled) addBarLabel(overlay, bar, formatTick(line * scale.step, scale.step), y);
  }
}

void addScaleBar(Overlay& overlay, const Frame& frame, std::span<const std::string> titles, const ColorScale& scale) {
  if (frame.panel.empty()) return;
  const double em = frame.textSize, thin = std::max(1.0, em / 15);
  const Bar bar = addBar(overlay, frame, titles, 0.5 * em, 0.8 * em, scale.map());

  double lastLabel = std::numeric_limits<double>::infinity();  // y coordinate of the last number added
  const auto mark = [&](double value, bool labelled) {
    const double y = bar.bottom - bar.height() * scale.fraction(value);
    labelled = labelled && y + 1.6 * bar.labelSize <= lastLabel;
    overlay.boxes.push_back({labelled ? bar.left : bar.right - 0.4 * em, y - 0.5 * thin,
                             bar.right + (labelled ? 0.35 * em : 0), y + 0.5 * thin, kTick});
    if (labelled && addBarLabel(overlay, bar, value == 0 ? "0" : formatNumber(value, 3), y)) lastLabel = y;
  };
  for (const double value : scaleMarks(scale)) mark(value, true);
  if (!scale.logarithmic()) return;
  for (double decade = powerOfTenBelow(scale.low()); decade < scale.high(); decade *= 10)
    for (int digit = 2; digit < 10; ++digit)
      if (digit * decade > scale.low() && digit * decade < scale.high()) mark(digit * decade, false);
}

void addAxes(Overlay& overlay, const Frame& frame, const PixelRect& section, char right, char up) {
  const double em = frame.textSize, size = std::max(kSmallestText, 0.85 * em), thin = std::max(1.0, em / 15);
  const double length = std::round(1.8 * em), gap = std::round(0.5 * em);
  const double extent = length + std::round(1.1 * size);  // length of an arrow with its letter
  if (section.width() < 3 * extent || section.height() < 3 * extent) return;

  // Choose the origin of the arrows: to the left of the section, below it, or within it on a background plate.
  double x = section.x0, y = section.y1;
  if (section.x0 - frame.view.x0 >= extent + 2 * gap) {
    x = section.x0 - gap - extent;
    y = std::min<double>(section.y1, frame.view.y1 - gap);
  } else if (frame.view.y1 - section.y1 >= extent + 2 * gap) {
    x = std::max<double>(x, frame.view.x0 + gap);  // room for the upward arrow's letter, which extends to the left of x
    y = section.y1 + gap + extent;
  } else {
    x += gap;
    y -= gap;
    overlay.boxes.push_back(
        {x - 0.5 * gap, y - extent - 0.5 * gap, x + extent + 0.5 * gap, y + 0.5 * gap, paperColor()});
  }
  addArrow(overlay, x, y - thin, length, thin, false);
  addArrow(overlay, x, y, length, thin, true);
  const std::string across(1, right), upward(1, up);
  // Lower-case letters are about half an em high. Each letter is centred on the axis of its arrow.
  addText(overlay, across, size, x + length + 0.3 * size, y - 0.5 * thin + 0.27 * size, kSoftInk);
  addText(overlay, upward, size, x + 0.5 * (thin - advanceOf(upward, size)), y - length - 0.45 * size, kSoftInk);
}

double addFacts(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                std::span<const std::pair<std::string, std::string>> facts) {
  if (frame.panel.empty()) return frame.panel.y0;
  const double em = frame.textSize, small = std::max(kSmallestText, 0.8 * em);
  Column column(overlay, frame, titles);
  for (const auto& [name, value] : facts) {
    if (column.top + 2.3 * em > column.bottom) break;
    addText(overlay, fitText(name, small, column.width()), small, column.left, column.top + capHeight(small), kSoftInk);
    addText(overlay, fitText(value, em, column.width()), em, column.left, column.top + 1.25 * small + capHeight(em),
            kInk);
    column.top += 1.25 * small + 1.75 * em;
  }
  return column.top;
}

double addShares(Overlay& overlay, const Frame& frame, double top, const std::string& title,
                 const std::map<int, double>& shares) {
  const double em = frame.textSize, small = std::max(kSmallestText, 0.8 * em), row = 1.2 * em;
  const double bottom = top + 1.6 * em + row * double(shares.size());
  if (frame.panel.empty() || shares.empty() || bottom > frame.panel.y1 - 0.5 * em) return top;
  const double left = frame.panel.x0 + em, right = frame.panel.x1 - em;
  addText(overlay, fitText(title, small, right - left), small, left, top + capHeight(small), kSoftInk);
  double nameWidth = 0, largest = 0;
  for (const auto& [level, share] : shares) {
    nameWidth = std::max(nameWidth, advanceOf(levelName(level), small));
    largest = std::max(largest, share);
  }
  const double barLeft = std::round(left + nameWidth + 0.6 * small);
  const double longest = right - barLeft - 0.5 * small - advanceOf("99.9 %", small);
  double middle = top + 1.6 * em;
  for (auto level = shares.rbegin(); level != shares.rend(); ++level, middle += row) {
    const std::string name = levelName(level->first), share = formatShare(level->second);
    const double baseline = std::round(middle + capHeight(small) / 2);
    addText(overlay, name, small, left + nameWidth - advanceOf(name, small), baseline, kInk);
    const double end = barLeft + std::max(0.0, longest * level->second / largest);
    overlay.boxes.push_back({barLeft, middle - 0.3 * small, end, middle + 0.3 * small, kShareBar});
    addText(overlay, share, small, end + 0.5 * small, baseline, kSoftInk);
  }
  return bottom + 0.4 * em;
}

double swatchHeight(const Frame& frame) { return 1.6 * std::max(kSmallestText, 0.8 * frame.textSize); }

void addSwatches(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                 std::span<const Swatch> swatches) {
  if (frame.panel.empty()) return;
  const double em = frame.textSize, small = std::max(kSmallestText, 0.8 * em), side = 0.9 * small;
  Column column(overlay, frame, titles);
  for (const Swatch& swatch : swatches) {
    const double height = swatchHeight(frame) + (swatch.count.empty() ? 0 : 1.6 * em);
    if (column.top + height > column.bottom) return;
    const double left = std::round(column.left), top = std::round(column.top), text = left + side + 0.5 * em;
    overlay.boxes.push_back({left, top, left + side, top + side, kTick});
    overlay.boxes.push_back({left + 1, top + 1, left + side - 1, top + side - 1, swatch.color});
    addText(overlay, fittingTitle(swatch.names, small, column.right - text), small, text,
            top + (side + capHeight(small)) / 2, kSoftInk);
    const double size = advanceOf(swatch.count, em) <= column.right - text ? em : small;
    addText(overlay, fitText(swatch.count, size, column.right - text), size, text, top + 1.35 * small + capHeight(em),
            kInk);
    column.top += height;
  }
}

void addCaption(Overlay& overlay, const Frame& frame, const std::string& name, std::span<const std::string> details) {
  if (frame.caption.empty()) return;
  const double em = frame.textSize;
  const PixelRect& strip = frame.caption;
  overlay.boxes.push_back({0, double(strip.y0), double(strip.x1), strip.y0 + std::max(1.0, em / 15), kRule});
  const double left = em, right = strip.x1 - em;
  const double baseline = std::round((strip.y0 + strip.y1 + capHeight(em)) / 2);

  const std::string shownName = fitText(name, em, details.empty() ? right - left : 0.45 * (right - left));
  addText(overlay, shownName, em, left, baseline, kInk);
  const double start = left + (shownName.empty() ? 0 : advanceOf(shownName, em) + em);
  std::string line;
  for (const std::string& detail : details) {
    const std::string longer = line.empty() ? detail : line + " · " + detail;
    if (advanceOf(longer, em) <= right - start) line = longer;
  }
  if (line.empty() && !details.empty()) line = fitText(details.front(), em, right - start);
  addText(overlay, line, em, start, baseline, kSoftInk);
}

void paint(Image& image, const Overlay& overlay) {
  for (const BoxItem& box : overlay.boxes) blendBox(image, box);
  for (const TextItem& text : overlay.texts) drawText(image, text.text, text.size, text.x, text.baseline, text.color);
}

Overlay enlarged(Overlay overlay, double factor) {
  for (BoxItem& box : overlay.boxes)
    for (double* side : {&box.x0, &box.y0, &box.x1, &box.y1}) *side *= factor;
  for (TextItem& text : overlay.texts)
    for (double* length : {&text.size, &text.x, &text.baseline}) *length *= factor;
  return overlay;
}

VectorLayer overlayLayer(const Overlay& overlay) {
  VectorLayer layer{"legend"};
  for (const BoxItem& box : overlay.boxes)
    layer.shapes.emplace_back(FilledShape{
        {{{box.x0, box.y0}, {box.x1, box.y0}, {box.x1, box.y1}, {box.x0, box.y1}, {box.x0, box.y0}}}, box.color});
  for (const TextItem& text : overlay.texts)  // baselines are rounded, as `drawText` rounds them
    layer.shapes.emplace_back(TextShape{text.text, text.size, {text.x, std::round(text.baseline)}, text.color});
  return layer;
}

std::string formatNumber(double value, int digits) {
  if (value == 0) return "0";
  const double size = std::abs(value);
  const std::string sign = value < 0 ? "−" : "";
  if (size < 1e-3 || size >= 999999.5) return sign + formatScientific(size, digits);
  return sign + formatPlain(size, digits);
}

std::string formatCount(std::size_t count) {
  std::string digits = std::to_string(count);
  for (int i = static_cast<int>(digits.size()) - 3; i > 0; i -= 3) digits.insert(static_cast<std::size_t>(i), ",");
  return digits;
}

std::string formatShare(double fraction) {
  if (fraction > 0 && fraction < 0.0005) return "<0.1 %";
  return printed(fraction > 0.9995 ? "%.0f %%" : "%.1f %%", 100 * fraction);
}

}  // namespace hpsdf::render
