// Stand-in for a header that the Mitsuba wheel mentions but does not ship. It declares the names that
// Mitsuba's own headers use, and no more: the shim neither constructs nor destroys a Bitmap, so the
// layouts below never meet those of the library.
#pragma once

#include <cstddef>
#include <cstdint>

namespace struct_jit {

enum class Type : uint32_t { UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64,
                             Float16, Float32, Float64, Invalid };

template <typename T> struct type_id {
    static constexpr Type value = Type::Invalid;
};
template <typename T> constexpr Type type_v = type_id<T>::value;

class Struct {
public:
    size_t size() const;
};

}
