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

/// A film: a sequence of pictures. It is written to a folder as frame-0000.png, frame-0001.png, …, or encoded as an MP4
/// file by ffmpeg. Until `publish` is called, an older film at the same place stays intact.
class Film {
 public:
  /// Makes a film without frames. The film becomes an MP4 file if `output` ends in .mp4, and otherwise a folder. Throws
  /// `Error` if the output cannot be written, if the folder holds files that are not an earlier film, or if an MP4 file
  /// is wanted and ffmpeg is not installed.
  explicit Film(const std::string& output);

  /// Adds a frame. `figures` is the JSON object that describes the frame in frames.json.
  void add(const render::Image& image, Json figures);
  std::size_t frames() const { return rows_.size(); }

  /// Encodes the MP4 file. Call it after the last frame. Does nothing if the output is a folder. If ffmpeg
  /// fails, throws `Error` with the last line that ffmpeg wrote.
  void encode(double framesPerSecond, const Progress& progress);

  /// Moves the finished film to its output. Returns a description of the film, which is also written as
  /// frames.json if the output is a folder.
  Json publish(const std::string& renderer);

  /// Returns a description of the film in one line. `about` is the object that `publish` returned.
  static std::string line(const Json& about);

 private:
  static std::string frameName(std::size_t frame);

  std::filesystem::path output_;
  std::filesystem::path ffmpeg_;          // path of ffmpeg; empty if the output is a folder
  std::unique_ptr<OutputFolder> folder_;  // null if the output is an MP4 file
  TemporaryFolder work_;
  int width_ = 0, height_ = 0;  // size of the last frame
  Json rows_ = Json::array();   // name and figures of each frame
};

}  // namespace hpsdf::app
