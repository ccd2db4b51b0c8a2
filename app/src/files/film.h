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
/// Before `publish` the output is not touched, so that an older film stays intact.
class Film {
 public:
  /// `output` is an MP4 where it ends in .mp4, else a folder. Throws `Error` where it cannot be written, where the
  /// folder holds files that are not an earlier film, or where an MP4 is wanted and ffmpeg is not installed.
  explicit Film(const std::string& output);

  void add(const render::Image& image);
  std::size_t frames() const { return frames_; }

  /// Encodes the MP4 after the last frame; does nothing for a folder. Throws `Error` with ffmpeg's last line on
  /// failure.
  void encode(double framesPerSecond, const Progress& progress);

  /// Describes the film as JSON. `rows` holds one object a frame, whose "file" is filled in here; `last` is any frame.
  Json about(const render::Image& last, const std::string& renderer, Json rows) const;

  /// Describes the film in one line, from the result of `about`.
  static std::string line(const Json& about);

  /// Moves the film to its output. A folder also receives frames.json, which holds `about`.
  void publish(const Json& about);

 private:
  static std::string frameName(std::size_t frame);

  std::filesystem::path output_;
  std::filesystem::path ffmpeg_;          // empty for a folder
  std::unique_ptr<OutputFolder> folder_;  // null for an MP4
  TemporaryFolder work_;
  std::size_t frames_ = 0;
};

}  // namespace hpsdf::app
