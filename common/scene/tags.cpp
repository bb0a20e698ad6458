#include "common/scene/tags.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

namespace pvsfarm {
namespace {

using nlohmann::json;

// Reads `key` into `flag` if it is there. False: it is there and not a boolean.
bool read_flag(const json& entry, const char* key, bool& flag) {
  const auto at = entry.find(key);
  if (at == entry.end()) return true;
  if (!at->is_boolean()) return false;
  flag = at->get<bool>();
  return true;
}

Status apply_entry(const json& entry, const std::string& place, SourceObject& object) {
  if (!entry.is_object()) return invalid_input(place + " is not a JSON object");
  const auto name = entry.find("name");
  if (name != entry.end() && (!name->is_string() || *name != object.name))
    return invalid_input(
        place + " is for " + name->dump(-1, ' ', false, json::error_handler_t::replace) +
        ", the scene file has '" + object.name + "' there; list the objects in file order");
  bool occluder = true;
  if (!read_flag(entry, "occluder", occluder) || !read_flag(entry, "occludee", object.occludee) ||
      !read_flag(entry, "dynamic", object.dynamic))
    return invalid_input(place + ": occluder, occludee and dynamic must be true or false");
  object.occluder = object.occluder && occluder;
  return {};
}

}  // namespace

Status apply_tags(const std::string& path, std::span<SourceObject> objects) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_input(path + ": cannot read the tags file; check the path");
  const json root = json::parse(file, nullptr, /*allow_exceptions=*/false);
  if (!root.is_object() || !root.contains("objects") || !root["objects"].is_array())
    return invalid_input(path + R"(: not a tags file; expected {"objects":[{"name":..},..]})");
  const json& entries = root["objects"];
  if (entries.size() != objects.size())
    return invalid_input(path + ": has " + std::to_string(entries.size()) +
                         " entries for the scene's " + std::to_string(objects.size()) +
                         " objects; write one an object, in file order");
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (const Status s = apply_entry(entries[i], path + ": entry " + std::to_string(i), objects[i]);
        !s.ok())
      return s;
  return {};
}

}  // namespace pvsfarm
