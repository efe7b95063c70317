"""Rodas4: a stiffly accurate Rosenbrock method of order 4 with an embedded one of order 3, in six stages.

Coefficients of E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.7 (code
RODAS), in the transformed form that needs no matrix-vector product: with c = 1/(h gamma),

    (c I - J) k_i = f(t + alpha_i h, y + sum_j a_ij k_j) + sum_j (c_ij / h) k_j + gamma_i h df/dt.

The new value is y + sum m_j k_j, the error estimate is k_6.
"""

from __future__ import annotations

ORDER = 4
STAGES = 6
GAMMA = 0.25
ALPHA = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
GAMMA_SUM = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)
A = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0),
)
C = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
M = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0, 1.0)
# Continuous extension of order 3: y(t + s h) = (1-s) y0 + s (y1 + (1-s) (d2 + s d3)), d = sum D_j k_j.
D2 = (10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662)
D3 = (-0.6762803392806898, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872)


def _sum(coefficients: tuple[float, ...], scale: str = "") -> str:
    terms = [f"{scale}{value!r} * k[{j}, i]" for j, value in enumerate(coefficients) if value != 0.0]
    return " + ".join(terms)


def stages_source() -> str:
    """Python source of `stages` and `dense`, unrolled over the stages, for the generated module.

    `stages(y, u0, slope, q, h, f, ft, w, k, v, g, y1)` fills the stage vectors `k` and the new value `y1`, given the
    inputs `u0` at the step's start, `f` and `ft` = df/dt there and the factors `w`.
    """
    lines = ["def stages(y, u0, slope, q, h, f, ft, w, k, v, u, g, y1):", "    r = 1.0 / h"]
    for stage in range(STAGES):
        value = "f"
        if stage:
            lines += [f"    for i in range(N): v[i] = y[i] + {_sum(A[stage])}"]
            lines += [f"    for i in range(NU): u[i] = u0[i] + {ALPHA[stage]!r} * h * slope[i]"]
            lines += ["    rhs(v, u, slope, q, g)"]
            value = "g"
        terms = f"{value}[i]"
        if GAMMA_SUM[stage]:
            terms += f" + {GAMMA_SUM[stage]!r} * h * ft[i]"
        if stage:
            terms += f" + r * ({_sum(C[stage])})"
        lines += [f"    for i in range(N): k[{stage}, i] = {terms}", f"    solve(w, k[{stage}])"]
    lines += [f"    for i in range(N): y1[i] = y[i] + {_sum(M)}", ""]
    lines += ["def dense(y, y1, k, s, out):", "    for i in range(N):"]
    lines += [f"        d2 = {_sum(D2)}", f"        d3 = {_sum(D3)}"]
    lines += ["        out[i] = (1.0 - s) * y[i] + s * (y1[i] + (1.0 - s) * (d2 + s * d3))", ""]
    return "\n".join(lines)
