#include "files/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout = "frames.json";  // file that marks a folder as the frames of a film
constexpr const char* kMovie = "film.mp4";

bool isFrameName(std::string_view name) {
  constexpr std::string_view kPrefix = "frame-", kSuffix = ".png";
  if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix) || name.size() < kPrefix.size() + 4 + kSuffix.size())
    return false;
  const auto digits = name.substr(kPrefix.size(), name.size() - kPrefix.size() - kSuffix.size());
  return std::ranges::all_of(digits, isDigit);
}

}  // namespace

std::string Film::frameName(std::size_t frame) { return fmt::format("frame-{:04}.png", frame); }

Film::Film(const std::string& output) : output_(output) {
  constexpr std::array kOthers = {".png", ".gif", ".webm", ".mkv", ".mov", ".avi"};
  const std::string kind = lowerExtension(output_);
  if (std::ranges::find(kOthers, kind) != kOthers.end())
    throw Error(fmt::format("{}: expected a folder for the frames, or a name that ends in .mp4", output));
  if (kind == ".mp4") {
    ffmpeg_ = findProgram("ffmpeg").value_or("");
    if (ffmpeg_.empty())
      throw Error(output + ": an MP4 needs the program ffmpeg, which is not in PATH; install it, or give a folder");
    checkWritable(output_);
    return;
  }
  folder_ = std::make_unique<OutputFolder>(output_);
  folder_->requireOwn(kAbout);
  checkWritable(output_ / kAbout);
}

void Film::add(const render::Image& image, Json figures) {
  Json row = {{"file", frameName(frames())}};
  savePng(image, work_.path() / frameName(frames()));
  row.update(figures);
  rows_.push_back(std::move(row));
  width_ = image.width;
  height_ = image.height;
}

void Film::encode(double framesPerSecond, const Progress& progress) {
  if (folder_) return;
  if (progress.report) progress.report("encoding", 0);
  // Encode with 4:2:0 chroma subsampling, which every player supports. This format requires an even width and height,
  // so pictures of odd size are padded.
  const std::string problem =
      runOtherProgram(ffmpeg_,
                      {"-hide_banner", "-loglevel", "error", "-y", "-framerate", fmt::format("{}", framesPerSecond),
                       "-start_number", "0", "-i", "frame-%04d.png", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt",
                       "yuv420p", "-movflags", "+faststart", kMovie},
                      work_.path(), kMovie, progress.cancelled);
  if (!problem.empty()) throw Error(fmt::format("{}: {}; give a folder instead", output_.string(), problem));
}

std::string Film::line(const Json& about) {
  return fmt::format("{}: {} frames, {}x{}, {}\n", about["output"].get<std::string>(), about["frames"].size(),
                     about["width"].get<int>(), about["height"].get<int>(), about["renderer"].get<std::string>());
}

Json Film::publish(const std::string& renderer) {
  const Json about = {
      {"output", output_.string()}, {"width", width_}, {"height", height_}, {"renderer", renderer}, {"frames", rows_}};
  const auto copy = [&](const std::string& name, const fs::path& to) {
    writeTextFile(to, readWholeFile((work_.path() / name).string()));
  };
  if (!folder_) {
    copy(kMovie, output_);
    return about;
  }
  folder_->keep();
  folder_->startAnew(kAbout, isFrameName);
  for (std::size_t frame = 0; frame < frames(); ++frame) copy(frameName(frame), output_ / frameName(frame));
  writeTextFile(output_ / kAbout, jsonText(about));
  return about;
}

}  // namespace hpsdf::app
