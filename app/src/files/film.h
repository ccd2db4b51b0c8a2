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

/// Pictures in order, as frame-0000.png, frame-0001.png … in a folder or as an MP4 that ffmpeg makes of them. Until it
/// is published nothing can be seen of it, and what was there before stays as it was.
class Film {
 public:
  /// `output` is an MP4 where it ends in .mp4, else a folder. Throws `Error` when it cannot be written, when other
  /// things lie in the folder, or when there is no ffmpeg for an MP4.
  explicit Film(const std::string& output);

  void add(const render::Image& image);
  std::size_t frames() const { return frames_; }

  /// After the last frame: makes the MP4, if it is to be one. Throws `Error` with ffmpeg's last line when that fails.
  void encode(double framesPerSecond, const Progress& progress);

  /// What is told of it: each frame has a row of `rows`, whose "file" is filled in; `last` is any of the frames.
  Json about(const render::Image& last, const std::string& renderer, Json rows) const;

  /// The same in a line, of what `about` returned.
  static std::string line(const Json& about);

  /// Puts everything in its place; beside the frames of a folder a file frames.json that tells what they show.
  void publish(const Json& about);

 private:
  static std::string frameName(std::size_t frame);
  void publishFolder(const Json& about);

  std::filesystem::path output_;
  std::filesystem::path ffmpeg_;          // empty where none is needed
  std::unique_ptr<OutputFolder> folder_;  // null for an MP4
  TemporaryFolder work_;
  std::size_t frames_ = 0;
};

}  // namespace hpsdf::app
