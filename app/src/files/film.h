#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "files/other_program.h"
#include "files/output_folder.h"
#include "hpsdf/error.h"
#include "hpsdf/render/image.h"
#include "text/json.h"

namespace hpsdf::app {

/// A sequence of pictures, written to a folder as frame-0000.png, frame-0001.png … or encoded as an MP4 by ffmpeg.
/// The output is not touched before `publish`, so that an older film stays intact until then.
class Film {
 public:
  /// `output` is an MP4 where it ends in .mp4, else a folder. Throws `Error` where it cannot be written, where the
  /// folder holds files that are not an earlier film, or where an MP4 is wanted and ffmpeg is not installed.
  explicit Film(const std::string& output);

  /// Adds a frame with its figures, an object for frames.json.
  void add(const render::Image& image, Json figures);
  std::size_t frames() const { return rows_.size(); }

  /// Encodes the MP4 after the last frame; does nothing for a folder. Throws `Error` with ffmpeg's last line on
  /// failure.
  void encode(double framesPerSecond, const Progress& progress);

  /// Moves the film to its output, and returns its description, which a folder also receives as frames.json.
  Json publish(const std::string& renderer);

  /// Describes the film in one line, from the result of `publish`.
  static std::string line(const Json& about);

 private:
  static std::string frameName(std::size_t frame);

  std::filesystem::path output_;
  std::filesystem::path ffmpeg_;          // empty for a folder
  std::unique_ptr<OutputFolder> folder_;  // null for an MP4
  TemporaryFolder work_;
  int width_ = 0, height_ = 0;  // size of the last frame
  Json rows_ = Json::array();   // name and figures of each frame
};

}  // namespace hpsdf::app
