"""C06: the impact does not depend on the choice of coordinates q = f(r)."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.vocabulary import INVERSE_MASS, MI, G, J, M, W, e, v

CASE = instance(
    {
        "F": [[1, 0], [0, 2]],
        "F⁻¹": [[1, 0], [0, "1/2"]],
        "M": [[1, 0], [0, 1]],
        "M⁻¹": [[1, 0], [0, 1]],
        "J": [[1, 1]],
        "G": [["1/2"]],
        "w": [1, 0],
        "J⁺": [["1/2"], ["1/2"]],
        "Jᵣ⁺": [["1/5"], ["2/5"]],
    },
    e=0,
)


def statement() -> Statement:
    f, fi, w = matrix("F", "d", "r"), matrix("F⁻¹", "r", "d"), vector("w", "r")
    mr, mri, jr = matrix("Mᵣ", "r", "r"), matrix("Mᵣ⁻¹", "r", "r"), matrix("Jᵣ", "c", "r")
    names = (
        equation("velocity: q̇ = F ṙ, with w = ṙ", v, f * w),
        equation("mass matrix in the new coordinates", mr, f.T * M * f),
        equation("its inverse", mri, fi * MI * fi.T),
        equation("contact Jacobian in the new coordinates", jr, J * f),
    )
    left, right = equation("F⁻¹ F = I", fi * f, 1), equation("F F⁻¹ = I", f * fi, 1)
    rules = (*names, *(name.T for name in names), left, right, left.T, right.T, INVERSE_MASS)
    inverse = identity("Mᵣ Mᵣ⁻¹ = I", mr * mri, 1, rules)
    delassus = identity("the Delassus matrix is the same", jr * mri * jr.T, W, rules)
    velocity = identity(
        "the velocity after the impact is the same",
        f * (w - (1 + e) * mri * jr.T * G * jr * w),
        v - (1 + e) * MI * J.T * G * J * v,
        rules,
    )
    energy = identity("the kinetic energy is the same", w.T * mr * w, v.T * M * v, rules)
    euclid, euclid_r = matrix("J⁺", "d", "c"), matrix("Jᵣ⁺", "r", "c")
    steps = (inverse, delassus, velocity, energy)
    return Statement(
        name="coordinate_invariance",
        title="The impact does not depend on coordinates",
        source="paper V-A; C06",
        statement=(
            r"Let $q = f(r)$ with invertible $F = \partial f / \partial r$, so $v = F w$, $M_r = F^\top M "
            r"F$, $J_r = J F$. The Delassus matrix, hence $G$ and the impulses, are the same, and $F w^+ = "
            r"v^+$."
        ),
        given=(left, right, INVERSE_MASS),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=CASE,
        needed=(
            Without(
                (left.name, right.name),
                CASE.with_values(**{"F⁻¹": [[1, 0], [0, 1]]}),
                "both sides of an inverse",
            ),
            Without(INVERSE_MASS.name, CASE.with_values(M=[[2, 0], [0, 1]])),
        ),
        twins=(
            Twin(
                "the plain pseudo-inverse J⁺ would be invariant too",
                equation(
                    "the same velocity",
                    f * (w - (1 + e) * euclid_r * jr * w),
                    v - (1 + e) * euclid * J * v,
                ),
                CASE,
                "changing the unit of one coordinate changes the outcome",
            ),
        ),
    )
