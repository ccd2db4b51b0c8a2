#pragma once
// Starts the program as a separate process, as a user does.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "outcome.h"

extern char** environ;

namespace hpsdf::app::started {

namespace fs = std::filesystem;

struct Call {
  std::vector<std::string> words;
  std::string input = {};
  std::map<std::string, std::string> environment = {};
  fs::path folder = {};            ///< working folder; if empty, the folder of the caller
  fs::path output = {};            ///< file to which standard output is redirected; if empty, the test reads the output
  bool stdoutClosed = false;       ///< true if the reading end of the standard output pipe is closed
  bool keepInputOpen = false;      ///< true if standard input stays open for `Process::type`
  std::size_t stackKilobytes = 0;  ///< limit of the stack's size; if 0, that of the caller
  std::size_t addressKilobytes = 0;  ///< limit of the address space's size; if 0, that of the caller
};

inline std::size_t lineCount(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// A running process of the program. Its output is read continuously, so that it never blocks on a full pipe.
class Process {
 public:
  explicit Process(const Call& call) {
    int in[2];
    int out[2];
    int err[2];
    if (pipe2(in, O_CLOEXEC) != 0 || pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0)
      throw std::runtime_error("pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
    if (!call.output.empty())
      posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, call.output.c_str(), O_WRONLY, 0);
    if (!call.folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, call.folder.c_str());
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGINT);  // a test that runs in the background inherits an ignored SIGINT
    sigaddset(&defaults, SIGTERM);
    sigaddset(&defaults, SIGHUP);  // nohup ignores it
    sigaddset(&defaults, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    if (call.stdoutClosed) close(out[0]);
    const int error = spawn(call, actions, attributes);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    close(in[0]);
    close(out[1]);
    close(err[1]);
    out_ = call.stdoutClosed ? -1 : out[0];
    err_ = err[0];
    if (error != 0) throw std::runtime_error(std::string(HPSDF_PROGRAM ": ") + std::strerror(error));
    in_ = in[1];
    if (!call.keepInputOpen) {
      type(call.input);
      closeInput();
    }
  }

  ~Process() {
    if (running_) {
      kill(id_, SIGKILL);
      waitpid(id_, nullptr, 0);
    }
    if (in_ >= 0) close(in_);
    if (out_ >= 0) close(out_);
    if (err_ >= 0) close(err_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Waits for the first complete line on standard error, or for the end of the process.
  void waitForErrorLine() {
    while (outcome_.err.find('\n') == std::string::npos && readSome()) {
    }
  }

  /// Waits until standard error contains `text`; returns false if the process ends before.
  bool waitForError(const std::string& text) {
    while (outcome_.err.find(text) == std::string::npos)
      if (!readSome()) return false;
    return true;
  }

  /// Waits until `count` lines were written to standard output, or until the process ends.
  void waitForLines(std::size_t count) {
    while (lineCount(outcome_.out) < count && readSome()) {
    }
  }

  /// Writes to the program's standard input. The inputs of these tests fit into a pipe's buffer, so that this never
  /// blocks. A program that has already ended with an error causes EPIPE, which is ignored.
  void type(const std::string& input) {
    std::signal(SIGPIPE, SIG_IGN);
    if (!input.empty() && write(in_, input.data(), input.size()) < 0 && errno != EPIPE)
      ADD_FAILURE() << "writing the input: " << std::strerror(errno);
  }

  void closeInput() {
    close(in_);
    in_ = -1;
  }

  pid_t id() const { return id_; }

  void send(int signal) { kill(id_, signal); }

  bool hasEnded() const {
    siginfo_t info{};
    waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT);
    return info.si_pid != 0;
  }

  /// Sends the signal as soon as `now` returns true; returns false if the process ended before.
  bool sendWhen(const std::function<bool()>& now, int signal) {
    while (!now()) {
      if (hasEnded()) return false;
      usleep(100);
    }
    send(signal);
    return true;
  }

  Outcome finish() {
    while (readSome()) {
    }
    int status = 0;
    waitpid(id_, &status, 0);
    running_ = false;
    outcome_.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    return outcome_;
  }

 private:
  int spawn(const Call& call, const posix_spawn_file_actions_t& actions, const posix_spawnattr_t& attributes) {
    std::vector<std::string> words = {HPSDF_PROGRAM};
    std::string limits;
    if (call.stackKilobytes > 0) limits += "ulimit -s " + std::to_string(call.stackKilobytes) + " && ";
    if (call.addressKilobytes > 0) limits += "ulimit -v " + std::to_string(call.addressKilobytes) + " && ";
    if (!limits.empty())  // a shell sets the limits and then becomes the program
      words = {"/bin/sh", "-c", limits + "exec \"$@\"", "sh", HPSDF_PROGRAM};
    const std::string program = words.front();
    words.insert(words.end(), call.words.begin(), call.words.end());
    std::vector<std::string> variables;
    for (char** entry = environ; *entry != nullptr; ++entry)
      if (!call.environment.contains(std::string(*entry, std::strcspn(*entry, "=")))) variables.emplace_back(*entry);
    for (const auto& [name, value] : call.environment) variables.push_back(name + "=" + value);
    auto pointers = [](std::vector<std::string>& texts) {
      std::vector<char*> result;
      for (std::string& text : texts) result.push_back(text.data());
      result.push_back(nullptr);
      return result;
    };
    return posix_spawn(&id_, program.c_str(), &actions, &attributes, pointers(words).data(),
                       pointers(variables).data());
  }

  /// Reads available output; returns false if both output streams have ended.
  bool readSome() {
    pollfd streams[] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};
    if (out_ < 0 && err_ < 0) return false;
    poll(streams, 2, -1);
    if (streams[0].revents != 0) readFrom(out_, outcome_.out);
    if (streams[1].revents != 0) readFrom(err_, outcome_.err);
    return true;
  }

  static void readFrom(int& stream, std::string& text) {
    char buffer[65536];
    const ssize_t count = read(stream, buffer, sizeof buffer);
    if (count > 0) {
      text.append(buffer, static_cast<std::size_t>(count));
    } else {
      close(stream);
      stream = -1;
    }
  }

  pid_t id_ = 0;
  bool running_ = true;
  int in_ = -1;
  int out_ = -1;
  int err_ = -1;
  Outcome outcome_;
};

inline Outcome run(const Call& call) { return Process(call).finish(); }

inline void writeFile(const fs::path& file, std::string_view text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  ASSERT_TRUE(stream.flush()) << file;
}

inline std::string readFile(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_TRUE(stream) << file;
  return text.str();
}

inline std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

}  // namespace hpsdf::app::started
