#include "text/json.h"

#include "hpsdf/field.h"

namespace hpsdf::app {

Json vectorJson(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json boxJson(const Box& box) { return Json::array({vectorJson(box.min()), vectorJson(box.max())}); }

std::string jsonLine(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"; }

std::string jsonText(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

void printJson(std::ostream& out, const Json& json) { out << jsonText(json); }

Json degreeJson(int degree) { return degree == kExactDegree ? Json(levelName(degree)) : Json(degree); }

std::string degreeText(const Json& degree) { return degree.is_string() ? degree.get<std::string>() : degree.dump(); }

}  // namespace hpsdf::app
