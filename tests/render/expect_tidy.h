#pragma once
// Checks that the layout of a picture's texts and boxes is readable.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "picture/legend.h"

namespace hpsdf::render {

/// Expects that nothing extends beyond the picture, and that texts are large enough and do not overlap.
inline void expectReadable(const Overlay& overlay, const Frame& frame, const std::string& what) {
  const PixelRect whole = {0, 0, frame.width, frame.height};
  std::vector<PixelRect> boxes;
  for (const TextItem& item : overlay.texts) {
    const PixelRect ink = measureText(item.text, item.size, item.x, item.baseline).ink;
    EXPECT_TRUE(whole.contains(ink)) << what << ": \"" << item.text << "\" is cut";
    EXPECT_GE(item.size, 7.9) << what << ": \"" << item.text << "\" cannot be read";
    boxes.push_back(ink);
  }
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_FALSE(boxes[i].overlaps(boxes[k]))
          << what << ": \"" << overlay.texts[i].text << "\" lies on \"" << overlay.texts[k].text << "\"";
  for (const BoxItem& box : overlay.boxes) {
    EXPECT_GE(box.x0, 0) << what;
    EXPECT_GE(box.y0, 0) << what;
    EXPECT_LE(box.x1, frame.width) << what;
    EXPECT_LE(box.y1, frame.height) << what;
  }
}

/// Expects a readable layout with no text over the view, i.e. all texts in the panel or the caption.
inline void expectTidy(const Overlay& overlay, const Frame& frame, const std::string& what) {
  expectReadable(overlay, frame, what);
  for (const TextItem& item : overlay.texts) {
    const PixelRect ink = measureText(item.text, item.size, item.x, item.baseline).ink;
    EXPECT_TRUE(frame.panel.contains(ink) || frame.caption.contains(ink)) << what << ": \"" << item.text << "\" strays";
  }
}

}  // namespace hpsdf::render
