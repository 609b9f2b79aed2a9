// Parts of a plugin by the names that it gives them.
#pragma once

#include "lanes.h"

#include <string>
#include <typeinfo>

namespace vpt {

// Values that a plugin offers under a name (Object::traverse).
struct NamedParts : TraversalCallback {
    std::vector<std::pair<std::string, Object *>> objects;
    std::vector<std::pair<std::string, std::pair<void *, const std::type_info *>>> values;

    explicit NamedParts(Object *object) { object->traverse(this); }

    Object *object(const std::string &name) const {
        for (auto &part : objects)
            if (part.first == name)
                return part.second;
        return nullptr;
    }

    template <typename T> const T *value(const std::string &name) const {
        for (auto &part : values)
            if (part.first == name && *part.second.second == typeid(T))
                return static_cast<const T *>(part.second.first);
        return nullptr;
    }

protected:
    void put_value(std::string_view name, void *value, uint32_t, const std::type_info &type) override {
        values.push_back({ std::string(name), { value, &type } });
    }
    void put_object(std::string_view name, Object *object, uint32_t) override {
        objects.push_back({ std::string(name), object });
    }
};

}
