#include "common/cells/cell_source.hpp"

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "common/base/file.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {
namespace {

using nlohmann::json;

// Far beyond it double precision itself is coarse, and products of coordinates leave its range.
constexpr double kLargestCoordinate = 1e12;

// The cells of one file, taken in one by one as the parser finishes them: what is wrong is kept as
// a text, the first that comes up, and the rest is passed over.
class CellsReader {
 public:
  explicit CellsReader(std::string path) : path_(std::move(path)) {}

  void take(const json& cell) {
    const std::size_t position = count_++;
    if (!failure_.empty()) return;
    if (position >= kMaxRootCells)
      return fail("more than " + std::to_string(kMaxRootCells) +
                  " cells; give larger ones, pvsfarm splits them where that pays");
    place_ = "cell " + std::to_string(position);
    RootCell root;
    if (!read_id(cell, root) || !read_shape(cell, root.cell)) return;
    const auto [first, is_new] = positions_.try_emplace(root.id, position);
    if (!is_new)
      return fail("has the id of cell " + std::to_string(first->second) +
                  "; every cell needs an id of its own");
    roots_.push_back(root);
  }

  Result<std::vector<RootCell>> finish(const json& document) && {
    if (!failure_.empty()) return invalid_input(failure_);
    if (!document.is_object() || !document.contains("cells") || !document["cells"].is_array())
      return invalid_input(path_ + ": no list \"cells\"; expected " +
                           R"({"up":"z","cells":[{"id":0,"aabb":[[x,y,z],[x,y,z]]}, ...]})");
    // What the parser's callback did not take is still there.
    if (!document["cells"].empty())
      return invalid_input(path_ + ": \"cells\" holds something that is not an object {...}");
    if (roots_.empty()) return invalid_input(path_ + ": no cells; give at least one");
    const json up = document.value("up", json("z"));
    if (up != "z" && up != "y")
      return invalid_input(path_ + ": \"up\" is " + up.dump() + "; it must be \"y\" or \"z\"");
    if (up == "y")
      for (RootCell& root : roots_) root.cell = turned_z_up(root.cell);
    return std::move(roots_);
  }

 private:
  void fail(const std::string& what) {
    failure_ = path_ + ": " + (place_.empty() ? "" : place_ + " ") + what;
  }
  bool failed(const std::string& what) {
    fail(what);
    return false;
  }

  bool read_id(const json& cell, RootCell& root) {
    if (!cell.contains("id")) return failed("has no \"id\"; give it an integer of its own");
    const json& id = cell["id"];
    const bool too_large = id.is_number_unsigned() && id.get<std::uint64_t>() > INT64_MAX;
    if (!id.is_number_integer() || too_large)
      return failed("has the id " + id.dump() + "; ids are integers of 64 bits");
    root.id = id.get<std::int64_t>();
    place_ += " (id " + std::to_string(root.id) + ")";
    return true;
  }

  bool read_shape(const json& cell, Cell& shape) {
    const bool aligned = cell.contains("aabb"), oriented = cell.contains("center");
    if (aligned == oriented)
      return failed(std::string("has ") + (aligned ? "both" : "neither") +
                    " \"aabb\" and \"center\"; give \"aabb\":[[x,y,z],[x,y,z]], or " +
                    "\"center\", \"axes\" and \"half\"");
    return aligned ? read_aligned(cell["aabb"], shape) : read_oriented(cell, shape);
  }

  bool read_aligned(const json& corners, Cell& shape) {
    if (!corners.is_array() || corners.size() != 2)
      return failed("has an \"aabb\" that is not two points [[x,y,z],[x,y,z]]");
    if (!read_vec(corners[0], "aabb", shape.lo) || !read_vec(corners[1], "aabb", shape.hi))
      return false;
    for (int a = 0; a < 3; ++a)
      if (shape.lo[a] > shape.hi[a])
        return failed(std::string("has its \"aabb\" upside down along ") + "xyz"[a] +
                      "; the first point must hold the lower coordinates");
    return check_size(shape);
  }

  bool read_oriented(const json& cell, Cell& shape) {
    Vec3 half;
    if (!read_vec(cell["center"], "center", shape.origin)) return false;
    if (!read_vec(cell.value("half", json()), "half", half)) return false;
    const json axes = cell.value("axes", json());
    if (!axes.is_array() || axes.size() != 3)
      return failed("has \"axes\" that are not three rows [[x,y,z],[x,y,z],[x,y,z]]");
    for (int a = 0; a < 3; ++a) {
      if (!read_vec(axes[a], "axes", shape.axes[a])) return false;
      if (half[a] < 0) return failed("has a negative \"half\"; give half the edge lengths");
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b <= a; ++b)
        if (std::abs(dot(shape.axes[a], shape.axes[b]) - (a == b ? 1 : 0)) > kAxisTolerance)
          return failed("has \"axes\" that are not orthonormal: " +
                        (a == b ? "row " + std::to_string(a) + " is not of length 1"
                                : "rows " + std::to_string(b) + " and " + std::to_string(a) +
                                      " are not at right angles") +
                        "; give unit rows with 7 digits or more");
    shape.lo = -half;
    shape.hi = half;
    return check_size(shape);
  }

  bool check_size(const Cell& shape) {
    if (shape.lo != shape.hi) return true;
    return failed("has no extent along any axis; a viewing cell is a box, give it a size");
  }

  bool read_vec(const json& value, const char* what, Vec3& out) {
    bool good = value.is_array() && value.size() == 3;
    for (int a = 0; good && a < 3; ++a) {
      good = value[a].is_number();
      if (good) out[a] = value[a].get<double>();
    }
    if (!good) return failed(std::string("has in \"") + what + "\" something that is not [x,y,z]");
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(out[a]) <= kLargestCoordinate))
        return failed(std::string("has in \"") + what + "\" a number beyond 1e12");
    return true;
  }

  // An exact quarter turn (internal_from_file). Adding 0 makes a negative zero a plain one.
  static Cell turned_z_up(const Cell& cell) {
    Cell turned = cell;
    const bool aligned = cell.origin == Vec3(0) && cell.axes == Cell{}.axes;
    if (aligned) {
      turned.lo = Vec3{cell.lo.x, -cell.hi.z, cell.lo.y} + 0.0;
      turned.hi = Vec3{cell.hi.x, -cell.lo.z, cell.hi.y} + 0.0;
      return turned;
    }
    turned.origin = internal_from_file(UpAxis::kY, cell.origin) + 0.0;
    for (Vec3& axis : turned.axes) axis = internal_from_file(UpAxis::kY, axis) + 0.0;
    return turned;
  }

  std::string path_;
  std::string place_;    // of the cell at hand
  std::string failure_;  // the first
  std::size_t count_ = 0;
  std::vector<RootCell> roots_;
  std::unordered_map<std::int64_t, std::size_t> positions_;  // by id
};

// "[json.exception.parse_error.101] parse error at line 1 ..." without its tag.
std::string plain_text(const json::exception& error) {
  const std::string text = error.what();
  const std::size_t tag = text.find("] ");
  return tag == std::string::npos ? text : text.substr(tag + 2);
}

bool read_number(std::string_view& text, double& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !std::isfinite(number) || number <= 0) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

Result<std::vector<RootCell>> read_cells(const std::string& path) {
  Result<std::string> text = read_file(path);
  if (!text) return invalid_input(text.error().text + "; check the path");
  CellsReader reader(path);
  // Cells are taken as they are parsed, not kept as a document: that would need ten times the room.
  bool inside_cells = false;
  const auto callback = [&](int depth, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::key && depth == 1) inside_cells = parsed == "cells";
    if (event != json::parse_event_t::object_end || depth != 2 || !inside_cells) return true;
    reader.take(parsed);
    return false;
  };
  try {
    const json document = json::parse(*text, callback);
    return std::move(reader).finish(document);
  } catch (const json::exception& error) {
    return invalid_input(path + ": not JSON: " + plain_text(error));
  }
}

Result<GridRequest> parse_grid(const std::string& text) {
  constexpr std::string_view kPrefix = "grid:";
  GridRequest request;
  std::string_view rest = text;
  bool good = rest.starts_with(kPrefix);
  if (good) rest.remove_prefix(kPrefix.size());
  good = good && read_number(rest, request.size);
  if (good && rest.starts_with(':')) {
    rest.remove_prefix(1);
    good = read_number(rest, request.height);
  }
  if (good && rest.empty()) return request;
  return Error{ErrorKind::kCommandLine,
               "cells " + text +
                   ": expected grid:SIZE or grid:SIZE:HEIGHT with positive metres, "
                   "such as grid:5 or grid:5:0.4"};
}

}  // namespace pvsfarm
