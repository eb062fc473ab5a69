// Signorini for C++17: owning handles and views over signorini.h. Header only; no exceptions, no state of its own.
//
// Functions that only pass on are not wrapped: call the C function with `world.get()`. Every wrapper returns the
// library's status; `signorini::failed(status)` is true for errors, not for notes.
#ifndef SIGNORINI_HPP
#define SIGNORINI_HPP

#include "signorini.h"

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace signorini {

using Status = SgnResult;

// True for errors; notes are successes.
constexpr bool failed(Status status) noexcept { return status < 0; }

// Name of a status, as "SGN_ERROR_BUSY".
inline const char *name(Status status) noexcept {
  const char *text = "unknown";
  sgn_result_name(status, &text);
  return text;
}

namespace detail {
inline Status init(SgnContextDesc &s) noexcept { return sgn_context_desc_init(&s, sizeof s); }
inline Status init(SgnErrorInfo &s) noexcept { return sgn_error_info_init(&s, sizeof s); }
inline Status init(SgnWorldDesc &s) noexcept { return sgn_world_desc_init(&s, sizeof s); }
inline Status init(SgnMaterialDesc &s) noexcept { return sgn_material_desc_init(&s, sizeof s); }
inline Status init(SgnShapeDesc &s) noexcept { return sgn_shape_desc_init(&s, sizeof s); }
inline Status init(SgnDeformableDesc &s) noexcept { return sgn_deformable_desc_init(&s, sizeof s); }
inline Status init(SgnSheetDesc &s) noexcept { return sgn_sheet_desc_init(&s, sizeof s); }
inline Status init(SgnSolidDesc &s) noexcept { return sgn_solid_desc_init(&s, sizeof s); }
inline Status init(SgnRigidDesc &s) noexcept { return sgn_rigid_desc_init(&s, sizeof s); }
inline Status init(SgnKinematicDesc &s) noexcept { return sgn_kinematic_desc_init(&s, sizeof s); }
inline Status init(SgnHalfSpaceDesc &s) noexcept { return sgn_half_space_desc_init(&s, sizeof s); }
inline Status init(SgnSystemDesc &s) noexcept { return sgn_system_desc_init(&s, sizeof s); }
inline Status init(SgnStepDesc &s) noexcept { return sgn_step_desc_init(&s, sizeof s); }
inline Status init(SgnStepReport &s) noexcept { return sgn_step_report_init(&s, sizeof s); }
inline Status init(SgnBodyInfo &s) noexcept { return sgn_body_info_init(&s, sizeof s); }
inline Status init(SgnCheckReport &s) noexcept { return sgn_check_report_init(&s, sizeof s); }
inline Status init(SgnVersion &s) noexcept { return sgn_version_init(&s, sizeof s); }
}  // namespace detail

// A struct of the library with its defaults: `auto desc = signorini::make<SgnRigidDesc>();`
template <class Struct>
Struct make() noexcept {
  Struct value;
  detail::init(value);
  return value;
}

// Format of an element type.
template <class T>
struct Format;
template <> struct Format<std::uint8_t> { static constexpr SgnFormat value = SGN_FORMAT_U8; };
template <> struct Format<std::uint32_t> { static constexpr SgnFormat value = SGN_FORMAT_U32; };
template <> struct Format<std::uint64_t> { static constexpr SgnFormat value = SGN_FORMAT_U64; };
template <> struct Format<float> { static constexpr SgnFormat value = SGN_FORMAT_F32; };
template <> struct Format<double> { static constexpr SgnFormat value = SGN_FORMAT_F64; };
template <> struct Format<std::array<std::uint32_t, 2>> { static constexpr SgnFormat value = SGN_FORMAT_U32X2; };
template <> struct Format<std::array<std::uint32_t, 3>> { static constexpr SgnFormat value = SGN_FORMAT_U32X3; };
template <> struct Format<std::array<std::uint64_t, 2>> { static constexpr SgnFormat value = SGN_FORMAT_U64X2; };
template <> struct Format<std::array<std::uint64_t, 3>> { static constexpr SgnFormat value = SGN_FORMAT_U64X3; };
template <> struct Format<std::array<float, 3>> { static constexpr SgnFormat value = SGN_FORMAT_F32X3; };
template <> struct Format<std::array<double, 3>> { static constexpr SgnFormat value = SGN_FORMAT_F64X3; };
template <> struct Format<std::array<float, 4>> { static constexpr SgnFormat value = SGN_FORMAT_F32X4; };
template <> struct Format<std::array<double, 4>> { static constexpr SgnFormat value = SGN_FORMAT_F64X4; };
template <> struct Format<std::array<float, 7>> { static constexpr SgnFormat value = SGN_FORMAT_F32X7; };
template <> struct Format<std::array<double, 7>> { static constexpr SgnFormat value = SGN_FORMAT_F64X7; };
// 3x3 blocks, row after row.
template <> struct Format<std::array<float, 9>> { static constexpr SgnFormat value = SGN_FORMAT_F32_3X3_ROWS; };
template <> struct Format<std::array<double, 9>> { static constexpr SgnFormat value = SGN_FORMAT_F64_3X3_ROWS; };

// View of elements that lie one after the other; valid as long as they are.
template <class T>
SgnView view(const T *first, std::uint64_t count) noexcept {
  return sgn_view(Format<T>::value, first, count);
}
template <class T>
SgnView view(const std::vector<T> &list) noexcept {
  return view(list.data(), list.size());
}
template <class T>
SgnViewMut view_mut(T *first, std::uint64_t count) noexcept {
  return sgn_view_mut(Format<T>::value, first, count);
}
template <class T>
SgnViewMut view_mut(std::vector<T> &list) noexcept {
  return view_mut(list.data(), list.size());
}

// Owns a context.
class Context {
 public:
  Context() noexcept = default;
  Context(Context &&other) noexcept : context_(std::exchange(other.context_, nullptr)) {}
  Context &operator=(Context &&other) noexcept {
    std::swap(context_, other.context_);
    return *this;
  }
  ~Context() { sgn_context_destroy(context_); }

  // Creates the context; `message`, if given, takes the reason of a failure.
  Status create(const SgnContextDesc *desc = nullptr, std::string *message = nullptr) {
    char text[256] = "";
    SgnContext *made = nullptr;
    const Status status = sgn_context_create(SGN_ABI_VERSION, desc, text, sizeof text, &made);
    if (failed(status)) {
      if (message) *message = text;
      return status;
    }
    sgn_context_destroy(context_);
    context_ = made;
    return status;
  }

  // Message of the calling thread's last failure.
  std::string last_error() const {
    auto info = make<SgnErrorInfo>();
    if (failed(sgn_context_last_error(context_, &info))) return {};
    std::string text(static_cast<std::size_t>(info.message_length) + 1, '\0');
    info.message = text.data();
    info.message_capacity = text.size();
    if (failed(sgn_context_last_error(context_, &info))) return {};
    text.pop_back();
    return text;
  }

  SgnContext *get() const noexcept { return context_; }
  explicit operator bool() const noexcept { return context_ != nullptr; }

 private:
  SgnContext *context_ = nullptr;
};

// Owns a world.
class World {
 public:
  World() noexcept = default;
  World(World &&other) noexcept : world_(std::exchange(other.world_, nullptr)) {}
  World &operator=(World &&other) noexcept {
    std::swap(world_, other.world_);
    return *this;
  }
  ~World() { sgn_world_destroy(world_); }

  Status create(const Context &context) noexcept {
    SgnWorld *made = nullptr;
    const Status status = sgn_world_create(context.get(), nullptr, &made);
    if (!failed(status)) {
      sgn_world_destroy(world_);
      world_ = made;
    }
    return status;
  }

  Status add(const SgnMaterialDesc &desc, SgnMaterialId &id) noexcept { return sgn_material_create(world_, &desc, &id); }
  Status add(const SgnDeformableDesc &desc, SgnBodyId &id) noexcept { return sgn_deformable_create(world_, &desc, &id); }
  Status add(const SgnSheetDesc &desc, SgnBodyId &id) noexcept { return sgn_sheet_create(world_, &desc, &id); }
  Status add(const SgnSolidDesc &desc, SgnBodyId &id) noexcept { return sgn_solid_create(world_, &desc, &id); }
  Status add(const SgnRigidDesc &desc, SgnBodyId &id) noexcept { return sgn_rigid_create(world_, &desc, &id); }
  Status add(const SgnKinematicDesc &desc, SgnBodyId &id) noexcept { return sgn_kinematic_create(world_, &desc, &id); }
  Status add(const SgnHalfSpaceDesc &desc, SgnBodyId &id) noexcept { return sgn_half_space_create(world_, &desc, &id); }
  Status add(const SgnSystemDesc &desc, SgnSystemId &id) noexcept { return sgn_system_create(world_, &desc, &id); }
  Status set_gravity(const std::array<double, 3> &g) noexcept { return sgn_world_set_gravity(world_, g.data()); }
  Status set_wind(const std::array<double, 3> &w) noexcept { return sgn_world_set_wind(world_, w.data()); }
  Status remove(SgnBodyId id) noexcept { return sgn_body_destroy(world_, id); }
  Status remove(SgnSystemId id) noexcept { return sgn_system_destroy(world_, id); }

  // Pushes a slot: a list of elements, or one.
  template <class T>
  Status push(SgnBodyId body, SgnSlot slot, const std::vector<T> &list, std::uint64_t flags = 0) noexcept {
    const SgnView from = view(list);
    return sgn_body_push(world_, body, slot, &from, flags);
  }
  template <class T>
  Status push(SgnBodyId body, SgnSlot slot, const T &one, std::uint64_t flags = 0) noexcept {
    const SgnView from = view(&one, 1);
    return sgn_body_push(world_, body, slot, &from, flags);
  }
  template <class T>
  Status push(SgnSystemId system, const std::vector<T> &blocks) noexcept {
    const SgnView from = view(blocks);
    return sgn_system_push(world_, system, &from);
  }

  // Pulls a slot into a list that has its size, or into one element.
  template <class T>
  Status pull(SgnBodyId body, SgnSlot slot, std::vector<T> &list) const noexcept {
    const SgnViewMut into = view_mut(list);
    return sgn_body_pull(world_, body, slot, &into);
  }
  template <class T>
  Status pull(SgnBodyId body, SgnSlot slot, T &one) const noexcept {
    const SgnViewMut into = view_mut(&one, 1);
    return sgn_body_pull(world_, body, slot, &into);
  }

  // Pulls an attribute of all contacts; the list takes their number.
  template <class T>
  Status pull_contacts(SgnContactAttribute attribute, std::vector<T> &list) const {
    std::uint64_t count = 0;
    Status status = sgn_world_pull_contacts(world_, attribute, nullptr, &count);
    if (failed(status)) return status;
    list.resize(static_cast<std::size_t>(count));
    const SgnViewMut into = view_mut(list);
    return sgn_world_pull_contacts(world_, attribute, &into, nullptr);
  }

  Status step(const SgnStepDesc &desc, SgnStepReport *report = nullptr) noexcept { return sgn_world_step(world_, &desc, report); }

  SgnWorld *get() const noexcept { return world_; }
  explicit operator bool() const noexcept { return world_ != nullptr; }

 private:
  SgnWorld *world_ = nullptr;
};

}  // namespace signorini

#endif
