// Programs that are recorded once and replayed. Dr.Jit writes, hashes and looks up a program each time that it is asked for
// results, which takes time by the program's length, and so by the number of a scene's materials, however few lanes there are.
#pragma once

#include "lanes.h"
#include "vpt.h"

#include <drjit/traversable_base.h>

#include <algorithm>
#include <map>
#include <string>
#include <unordered_set>

namespace vpt {

// What tells a program from others over the same scene, besides its inputs.
struct ProgramKey {
    const char *name;
    const VptRules *rules = nullptr;
    const Planes *planes = nullptr;

    std::string text() const {
        std::string out(name);
        if (rules)
            out.append((const char *) rules, sizeof(*rules));
        return planes ? out + planes->pattern() : out;
    }
};

// The indices of Dr.Jit's variables that a value is made of; 0 where it has none yet.
using Variables = std::vector<uint32_t>;

template <typename Value> Variables variables_of(const Value &value) {
    Variables indices;
    dr::traverse_1_fn_ro(value, &indices, [](void *p, uint64_t index, const char *, const char *) {
        static_cast<Variables *>(p)->push_back((uint32_t) index);
    });
    return indices;
}

inline void evaluate(const Variables &variables) {
    for (uint32_t index : variables)
        if (index)
            jit_var_schedule(index);
    jit_eval();
}

// What a program leaves in its outputs: nothing, a literal, which is as wide as an input or as it ever was, or what was computed.
class ProgramResult {
public:
    // Adds a variable to `computed` that is none of the others.
    ProgramResult(uint32_t index, const Variables &inputs, Variables &computed) {
        if (index == 0)
            return;
        VarInfo info = jit_var_info(index);
        if (info.state == VarState::Literal) {
            m_kind = Kind::Literal;
            m_type = info.type;
            m_literal = info.literal;
            m_width = info.size;
            m_like = info.size == 1 ? inputs.size() : find(inputs, [&](uint32_t i) { return i && jit_var_size(i) == info.size; });
        } else {
            m_kind = Kind::Computed;
            m_place = find(computed, [&](uint32_t i) { return i == index; });
            if (m_place == computed.size())
                computed.push_back(index);
        }
    }

    // Of a replay; a new reference.
    uint32_t variable(JitBackend backend, const Variables &inputs, const Variables &computed) const {
        switch (m_kind) {
            case Kind::Literal:
                return jit_var_literal(backend, m_type, &m_literal,
                                       m_like < inputs.size() ? jit_var_size(inputs[m_like]) : m_width);
            case Kind::Computed: jit_var_inc_ref(computed[m_place]); return computed[m_place];
            default: return 0;
        }
    }

private:
    template <typename Test> static size_t find(const Variables &variables, Test &&test) {
        return (size_t) (std::find_if(variables.begin(), variables.end(), test) - variables.begin());
    }

    enum class Kind { Nothing, Literal, Computed } m_kind = Kind::Nothing;
    VarType m_type = VarType::Void;
    uint64_t m_literal = 0;
    size_t m_width = 1, m_like = 0, m_place = 0;
};

// A recording, or that there can be none.
class FrozenProgram {
public:
    FrozenProgram() = default;
    FrozenProgram(const FrozenProgram &) = delete;
    FrozenProgram &operator=(const FrozenProgram &) = delete;
    ~FrozenProgram() { clear(); }

    // Says whether the program was run.
    template <typename Outputs, typename Program>
    bool record(JitBackend backend, const Variables &inputs, const Variables &surroundings, Outputs &outputs, Program &&program) {
        if (!hold(surroundings, inputs))
            return false;
        Variables all = evaluated(inputs), computed;
        jit_freeze_start(backend, all.data(), (uint32_t) all.size());
        try {
            program();
            evaluate(variables_of(outputs));
        } catch (...) { // as it may have failed because it was recorded, it is run again without that
            jit_freeze_abort(backend);
            clear();
            return false;
        }
        for (uint32_t index : variables_of(outputs))
            m_results.emplace_back(index, inputs, computed);
        m_computed = computed.size();
        try {
            m_recording = jit_freeze_stop(backend, computed.data(), (uint32_t) computed.size());
        } catch (const std::exception &e) {
            Log(Debug, "vpt: a program of Dr.Jit is written anew for each call: %s", e.what());
            clear();
        }
        return true;
    }

    // Says whether the program was run.
    template <typename Outputs> bool replay(JitBackend backend, const Variables &inputs, Outputs &outputs) {
        if (!m_recording)
            return false;
        Variables all = evaluated(inputs), computed(m_computed);
        if (!jit_freeze_dry_run(m_recording, all.data())) {
            clear();
            return false;
        }
        jit_freeze_replay(m_recording, all.data(), computed.data());
        dr::vector<uint64_t> results;
        for (const ProgramResult &result : m_results)
            results.push_back(result.variable(backend, inputs, computed));
        dr::detail::update_indices(outputs, results);
        for (uint64_t index : results)
            jit_var_dec_ref((uint32_t) index);
        for (uint32_t index : computed)
            jit_var_dec_ref(index);
        return true;
    }

private:
    void clear() {
        if (m_recording)
            jit_freeze_destroy(m_recording);
        m_recording = nullptr;
        for (uint32_t index : m_surroundings)
            jit_var_dec_ref(index);
        m_surroundings.clear();
        m_results.clear();
    }

    // What a recording is given: what has memory.
    Variables evaluated(const Variables &inputs) const {
        Variables out;
        for (uint32_t index : inputs)
            if (index && jit_var_state(index) == VarState::Evaluated)
                out.push_back(index);
        out.insert(out.end(), m_surroundings.begin(), m_surroundings.end());
        return out;
    }

    // False if any of the surroundings is an input, too, which need not be so another time.
    bool hold(const Variables &surroundings, const Variables &inputs) {
        evaluate(surroundings);
        std::unordered_set<const void *> seen, own;
        for (uint32_t index : evaluated(inputs))
            own.insert(jit_var_info(index).data);
        for (uint32_t index : surroundings) {
            if (index == 0 || jit_var_state(index) != VarState::Evaluated)
                continue;
            const void *data = jit_var_info(index).data;
            if (own.count(data))
                return false;
            if (!seen.insert(data).second)
                continue;
            jit_var_inc_ref(index);
            m_surroundings.push_back(index);
        }
        return true;
    }

    Recording *m_recording = nullptr;
    Variables m_surroundings;
    std::vector<ProgramResult> m_results;
    size_t m_computed = 0;
};

// The programs over one scene. Not for several threads at once: Dr.Jit is driven by one.
template <typename Float> class FrozenPrograms {
public:
    static constexpr JitBackend Backend = dr::backend_v<Float>;
    // CUDA's programs are written anew: nobody has tried otherwise.
    static constexpr bool Freezes = dr::is_llvm_v<Float>;

    // Runs `program` or replays what was recorded of it: it reads `inputs` and what `surroundings()` lists, and leaves its results
    // in `outputs`, evaluated. It may be run twice, and may scatter into inputs that are outputs, too.
    template <typename Inputs, typename Outputs, typename Surroundings, typename Program>
    void run(const ProgramKey &which, const Inputs &inputs, Outputs &outputs, const Surroundings &surroundings,
             Program &&program) {
        Variables variables = variables_of(inputs);
        evaluate(variables);
        std::string key = which.text();
        bool done = false;
        if (Freezes && jit_flag(JitFlag::KernelFreezing) && !jit_flag(JitFlag::FreezingScope) && describe(variables, key)) {
            if (auto known = m_programs.find(key); known != m_programs.end())
                done = known->second.replay(Backend, variables, outputs);
            else if (m_programs.size() < Most)
                done = m_programs[std::move(key)].record(Backend, variables, surroundings(), outputs, program);
        }
        if (!done) {
            program();
            evaluate(variables_of(outputs));
        }
    }

private:
    // Literals that change with every call are not worth a recording each.
    static constexpr size_t Most = 256;

    // What a recording takes for granted of its inputs: literals, and which are the same, single, or as wide as each other.
    static bool describe(const Variables &variables, std::string &key) {
        std::vector<size_t> widths;
        auto add = [&key](auto value) { key.append((const char *) &value, sizeof(value)); };
        auto place_in = [](const auto &list, auto value) {
            return (uint16_t) (std::find(list.begin(), list.end(), value) - list.begin());
        };
        for (size_t i = 0; i < variables.size(); ++i) {
            uint16_t first = place_in(variables, variables[i]);
            add(first);
            if (first != i || variables[i] == 0)
                continue;
            VarInfo info = jit_var_info(variables[i]);
            bool literal = info.state == VarState::Literal;
            if (!literal && info.state != VarState::Evaluated)
                return false;
            add(place_in(widths, info.size));
            if (place_in(widths, info.size) == widths.size())
                widths.push_back(info.size);
            add((uint8_t) info.type);
            add((uint8_t) (literal | (info.size == 1) << 1 | info.unaligned << 2));
            if (literal)
                add(info.literal);
        }
        return true;
    }

    std::map<std::string, FrozenProgram> m_programs;
};

}
