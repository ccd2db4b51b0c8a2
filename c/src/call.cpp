#include "call.h"

#include <new>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::c {
namespace {

/// The message of the last error in this thread. Where there was no memory for it, a constant stands in its place.
thread_local std::string lastMessage;
thread_local const char* lastError = "";

hpsdf_status failed(hpsdf_status status, const char* message) noexcept {
  try {
    lastMessage = message;
    lastError = lastMessage.c_str();
  } catch (...) {
    lastError = "not enough memory for the message of the error";
  }
  return status;
}

hpsdf_status statusOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::option:
      return HPSDF_OPTION_ERROR;
    case ErrorKind::file:
      return HPSDF_FILE_ERROR;
    case ErrorKind::mesh:
      return HPSDF_MESH_ERROR;
    case ErrorKind::field:
      return HPSDF_FIELD_ERROR;
    case ErrorKind::limit:
      return HPSDF_LIMIT_ERROR;
    case ErrorKind::general:
      break;
  }
  return HPSDF_GENERAL_ERROR;
}

}  // namespace

hpsdf_status statusOfException() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    return failed(statusOf(error.kind()), error.what());
  } catch (const Cancelled& cancelled) {
    return failed(HPSDF_CANCELLED, cancelled.what());
  } catch (const ArgumentError& error) {
    return failed(HPSDF_ARGUMENT_ERROR, error.what());
  } catch (const CallbackError& error) {
    return failed(HPSDF_CALLBACK_ERROR, error.what());
  } catch (const std::bad_alloc&) {
    return failed(HPSDF_LIMIT_ERROR,
                  "not enough memory; a larger tolerance or target error, or a coarser grid, needs less");
  } catch (const std::length_error&) {
    return failed(HPSDF_LIMIT_ERROR, "an array would be longer than is possible");
  } catch (const std::exception& error) {
    return failed(HPSDF_GENERAL_ERROR, error.what());
  } catch (...) {
    return failed(HPSDF_GENERAL_ERROR, "a function of the caller's has thrown something that is no std::exception");
  }
}

}  // namespace hpsdf::c

const char* hpsdf_version(void) { return HPSDF_VERSION; }

const char* hpsdf_last_error(void) { return hpsdf::c::lastError; }
