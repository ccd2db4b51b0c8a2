// Drops files by the protocol XDND, version 5: freedesktop.org/wiki/Specifications/XDND.

#include "file_drop.h"

#include <X11/Xlib.h>
#include <poll.h>

#include <array>

namespace hpsdf::app {
namespace {

constexpr int kPatience = 30000;  // longest wait for an answer, milliseconds

/// The source of a drop: an invisible window that owns the dragged data.
class Source {
 public:
  Source(Display* display, Window target, std::string data)
      : display_(display), target_(target), data_(std::move(data)) {
    window_ = XCreateSimpleWindow(display_, DefaultRootWindow(display_), 0, 0, 1, 1, 0, 0, 0);
    XSetSelectionOwner(display_, atom("XdndSelection"), window_, CurrentTime);
  }

  bool drop() {
    const long list = long(atom("text/uri-list"));
    send("XdndEnter", {long(window_), 5L << 24, list, 0, 0});
    send("XdndPosition", {long(window_), 0, 100L << 16 | 100, CurrentTime, long(atom("XdndActionCopy"))});
    send("XdndDrop", {long(window_), 0, CurrentTime, 0, 0});
    return answer();
  }

 private:
  Atom atom(const char* name) const { return XInternAtom(display_, name, False); }

  void send(const char* message, const std::array<long, 5>& data) const {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = target_;
    event.xclient.message_type = atom(message);
    event.xclient.format = 32;
    for (std::size_t i = 0; i < data.size(); ++i) event.xclient.data.l[i] = data[i];
    XSendEvent(display_, target_, False, NoEventMask, &event);
    XFlush(display_);
  }

  /// Gives the data to the target, until it says that it has finished.
  bool answer() const {
    for (;;) {
      pollfd connection{ConnectionNumber(display_), POLLIN, 0};
      if (XPending(display_) == 0 && poll(&connection, 1, kPatience) <= 0) return false;
      XEvent event;
      XNextEvent(display_, &event);
      if (event.type == SelectionRequest) give(event.xselectionrequest);
      if (event.type == ClientMessage && event.xclient.message_type == atom("XdndFinished")) return true;
    }
  }

  void give(const XSelectionRequestEvent& request) const {
    XChangeProperty(display_, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(data_.data()), int(data_.size()));
    XEvent event{};
    event.xselection.type = SelectionNotify;
    event.xselection.requestor = request.requestor;
    event.xselection.selection = request.selection;
    event.xselection.target = request.target;
    event.xselection.property = request.property;
    event.xselection.time = request.time;
    XSendEvent(display_, request.requestor, False, NoEventMask, &event);
    XFlush(display_);
  }

  Display* display_;
  Window target_, window_;
  std::string data_;
};

}  // namespace

bool dropFile(const std::string& display, unsigned long window, const std::string& file) {
  Display* const opened = XOpenDisplay(display.c_str());
  if (opened == nullptr) return false;
  const bool taken = Source(opened, window, "file://" + file + "\r\n").drop();
  XCloseDisplay(opened);
  return taken;
}

}  // namespace hpsdf::app
