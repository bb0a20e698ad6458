#include "common/wire/roles.hpp"

namespace pvsfarm {
namespace {

// The role that sends a message to a coordinator; an admin may also what a viewer may.
struct Sender {
  template <class Other>
  Role operator()(const Other&) const {
    return Role::kNone;  // a coordinator's own messages, and new ones
  }
  Role operator()(const Hello&) const { return Role::kWorker; }
  Role operator()(const Heartbeat&) const { return Role::kWorker; }
  Role operator()(const ResultBegin&) const { return Role::kWorker; }
  Role operator()(const FindingBegin&) const { return Role::kWorker; }
  Role operator()(const ResultChunk&) const { return Role::kWorker; }
  Role operator()(const ResultEnd&) const { return Role::kWorker; }
  Role operator()(const TaskFailed&) const { return Role::kWorker; }
  Role operator()(const BlobGet&) const { return Role::kWorker; }
  Role operator()(const Draining&) const { return Role::kWorker; }
  Role operator()(const Bye&) const { return Role::kWorker; }
  Role operator()(const StatusGet&) const { return Role::kViewer; }
  Role operator()(const Control&) const { return Role::kAdmin; }
};

}  // namespace

bool permits(Role role, const Message& message) {
  const Role sender = std::visit(Sender{}, message);
  if (sender == Role::kNone || role == Role::kNone) return false;
  return role == sender || role == Role::kLocal ||
         (role == Role::kAdmin && sender == Role::kViewer);
}

std::string_view role_name(Role role) {
  switch (role) {
    case Role::kViewer:
      return "viewer";
    case Role::kWorker:
      return "worker";
    case Role::kAdmin:
      return "admin";
    case Role::kLocal:
      return "local";
    case Role::kNone:
      break;
  }
  return "none";
}

std::optional<Role> role_named(std::string_view name) {
  for (const Role role : {Role::kViewer, Role::kWorker, Role::kAdmin})
    if (role_name(role) == name) return role;
  return std::nullopt;
}

}  // namespace pvsfarm
