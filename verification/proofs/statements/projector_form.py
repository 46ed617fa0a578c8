"""The form the resolver computes: an orthogonal projector in the coordinates u = Lᵀ v."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import MI, ONE, G, J, M, W, e, v

# M = 4, one wall reported twice: L = 2, A = (1/2, 1/2)ᵀ = C Qᵀ with Q = 1
CASE = instance(
    {
        "L": [[2]],
        "L⁻¹": [["1/2"]],
        "Q": [[1]],
        "C": [["1/2"], ["1/2"]],
        "D": [[1], [1]],
        "G": [[1, 1], [1, 1]],
        "v": [-1],
    },
    e="1/2",
)


def statement() -> Statement:
    low, li, q = matrix("L", "d", "d"), matrix("L⁻¹", "d", "d"), matrix("Q", "d", "r")
    c, d, a, u = matrix("C", "c", "r"), matrix("D", "c", "r"), matrix("A", "c", "d"), vector("u", "d")
    names = (
        equation("mass matrix by its Cholesky factor", M, low * low.T),
        equation("its inverse", MI, li.T * li),
        equation("rows in the span of Q", a, c * q.T),
        equation("contact Jacobian: A = J L⁻ᵀ", J, a * low.T),
        equation("velocity in the kinetic metric", u, low.T * v),
    )
    orthonormal = equation("Qᵀ Q = I", q.T * q, 1)
    spanned = equation("Q lies in the span of the rows: Q = Aᵀ D", q, a.T * d)
    inverse = equation("G is a {1}-inverse of J M⁻¹ Jᵀ", W * G * W, W)
    left = equation("L⁻¹ L = I", li * low, 1)
    rules = (*names, *(name.T for name in names), orthonormal, left, left.T)
    unit = identity(
        "Dᵀ C = I",
        d.T * c,
        1,
        (names[2], names[2].T, orthonormal),
        "Qᵀ Q = Dᵀ A Q = Dᵀ C Qᵀ Q",
        first=(Cofactor(-ONE, spanned.T, q), Cofactor(ONE, orthonormal, ONE)),
    )
    core = identity(
        "Cᵀ G C = I",
        c.T * G * c,
        1,
        (*rules, unit.claim, unit.claim.T),
        "J M⁻¹ Jᵀ = C Cᵀ; multiply its {1}-inverse equation by Dᵀ and D",
        first=(Cofactor(d.T, inverse, d),),
    )
    projector = identity("Aᵀ G A = Q Qᵀ", a.T * G * a, q * q.T, (names[2], names[2].T, core.claim))
    impact = identity(
        "the impact (21) in u",
        low.T * (v - (1 + e) * MI * J.T * G * J * v),
        u - (1 + e) * q * q.T * u,
        (*rules, core.claim),
        "Lᵀ M⁻¹ Jᵀ G J v = Aᵀ G A u = Q Qᵀ u",
    )
    after = u - (1 + e) * q * q.T * u
    energy = identity(
        "the energy: |u|² − |u⁺|²", u.T * u - after.T * after, (1 - e * e) * u.T * q * q.T * u, (orthonormal,)
    )
    kinetic = identity("|u|² is twice the kinetic energy", u.T * u, v.T * M * v, rules)
    return Statement(
        name="projector_form",
        title="The impact is an orthogonal projection",
        source="docs/theory.md; paper (21)",
        statement=(
            r"Let $M = L L^\top$, $u = L^\top v$, $A = J L^{-\top}$ and let the columns of $Q$ be an "
            r"orthonormal basis of the row space of $A$. Then (21) is $u^+ = u - (1+e) Q Q^\top u$ and "
            r"$|u|^2 - |u^+|^2 = (1-e^2) |Q^\top u|^2$. No Delassus matrix is formed."
        ),
        given=(orthonormal, spanned, inverse, left),
        definitions=names,
        steps=(unit, core, projector, impact, energy, kinetic),
        concludes=(projector.claim.name, impact.claim.name, energy.claim.name, kinetic.claim.name),
        witness=CASE,
        needed=(
            Without(orthonormal.name, CASE.with_values(Q=[[2]], C=[["1/4"], ["1/4"]], D=[[2], [2]])),
            Without(spanned.name, CASE.with_values(C=[[0], [0]], G=[[1, 0], [0, 1]])),
            Without(inverse.name, CASE.with_values(G=[[5, 0], [0, 5]])),
            Without(left.name, CASE.with_values(**{"L⁻¹": [[1]], "G": [["1/4"] * 2] * 2})),
        ),
        twins=(
            Twin(
                "Q Qᵀ may act on v itself",
                equation("(21) in v", v - (1 + e) * MI * J.T * G * J * v, v - (1 + e) * q * q.T * v),
                instance(
                    {
                        "L": [[1, 0], [1, 1]],
                        "L⁻¹": [[1, 0], [-1, 1]],
                        "Q": [[1], [0]],
                        "C": [[1]],
                        "D": [[1]],
                        "G": [[1]],
                        "v": [1, 1],
                    },
                    e=0,
                ),
            ),
        ),
    )
