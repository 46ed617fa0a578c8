"""The Coq side of `second_tool`: how expressions are written in Coq, and the ring with transposition they belong to."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import Expression, Letter
from verification.proofs.steps import Refused

SPELLED = {"⁻¹": "_inv", "⁺": "_plus", "ₙ": "_n", "ω": "omega"}  # plain letters for Coq

PRELUDE = """\
From Coq Require Import Ncring Ncring_tac.
Section Certificates.

(* a ring that is not commutative *)
Variable R : Type.
Variables (zero one : R) (add mul sub : R -> R -> R) (opp : R -> R).
Declare Scope words_scope.
Infix "+" := add : words_scope.
Infix "-" := sub : words_scope.
Infix "*" := mul : words_scope.
Open Scope words_scope.
Hypothesis zero_add : forall x, zero + x = x.
Hypothesis add_comm : forall x y, x + y = y + x.
Hypothesis add_assoc : forall x y z, x + (y + z) = x + y + z.
Hypothesis one_mul : forall x, one * x = x.
Hypothesis mul_one : forall x, x * one = x.
Hypothesis mul_assoc : forall x y z, x * (y * z) = x * y * z.
Hypothesis add_mul : forall x y z, (x + y) * z = x * z + y * z.
Hypothesis mul_add : forall x y z, z * (x + y) = z * x + z * y.
Hypothesis sub_opp : forall x y, x - y = x + opp y.
Hypothesis add_opp : forall x, x + opp x = zero.
Instance ring_operations : @Ring_ops R zero one add mul sub opp (@eq R) := {}.
Instance ring_of_words : @Ring R zero one add mul sub opp (@eq R) ring_operations.
Proof.
  split; [exact eq_equivalence | | | | | exact zero_add | exact add_comm | exact add_assoc | exact one_mul
    | exact mul_one | exact mul_assoc | exact add_mul | exact mul_add | exact sub_opp | exact add_opp];
    repeat (intros ? ? H; rewrite H; clear H); reflexivity.
Qed.

(* transposition *)
Variable tr : R -> R.
Hypothesis tr_tr : forall x, tr (tr x) = x.
Hypothesis tr_zero : tr zero = zero.
Hypothesis tr_one : tr one = one.
Hypothesis tr_add : forall x y, tr (x + y) = tr x + tr y.
Hypothesis tr_opp : forall x, tr (opp x) = opp (tr x).
Hypothesis tr_mul : forall x y, tr (x * y) = tr y * tr x.

(* what a certificate needs *)
Lemma difference : forall a b, a = b -> a - b = zero.
Proof. intros a b H. rewrite H, sub_opp. apply add_opp. Qed.

Lemma from_difference : forall a b, a - b = zero -> a = b.
Proof.
  intros a b H. transitivity ((a - b) + b); [non_commutative_ring | rewrite H; apply zero_add].
Qed.

Lemma zero_by : forall l r {a b}, a = b -> l * (a - b) * r = zero.
Proof. intros l r a b H. rewrite (difference _ _ H). non_commutative_ring. Qed.

Lemma add_zeros : forall {x y}, x = zero -> y = zero -> x + y = zero.
Proof. intros x y H K. rewrite H, K. apply zero_add. Qed.

Definition zero_is_zero : zero = zero := eq_refl.

Lemma certificate : forall a b s, s = zero -> a - b = s -> a = b.
Proof. intros a b s H K. apply from_difference. rewrite K. exact H. Qed.

(* expansion: words bracketed to the right, scalars moved to the front, then the ring axioms decide *)
Lemma past : forall s x, x * s = s * x -> forall y, x * (s * y) = s * (x * y).
Proof. intros s x H y. rewrite mul_assoc, H. symmetry. apply mul_assoc. Qed.
Lemma to_the_right : forall x y z, x * y * z = x * (y * z).
Proof. intros. symmetry. apply mul_assoc. Qed.
Lemma opp_mul : forall x y, opp x * y = opp (x * y).
Proof. intros. non_commutative_ring. Qed.
Lemma mul_opp : forall x y, x * opp y = opp (x * y).
Proof. intros. non_commutative_ring. Qed.
Hint Rewrite sub_opp add_mul mul_add to_the_right opp_mul mul_opp one_mul mul_one : expand.
Hint Rewrite tr_tr tr_zero tr_one tr_add tr_opp tr_mul : expand.
Ltac expand := autorewrite with expand;
  (non_commutative_ring || fail "the certificate leaves a remainder")."""


class NotExportable(Refused):
    """The proof contains a step that is not an identity between integer combinations of words."""


def in_coq(value: Expression) -> str:
    """Return an expression in Coq as a sum of words, each with its scalars in front."""
    return " + ".join(_term(scalars, word, k) for (scalars, word), k in value.ordered()) or "zero"


def _term(scalars: tuple[str, ...], word: tuple[Letter, ...], coefficient: Fraction) -> str:
    if coefficient.denominator != 1:
        raise NotExportable(f"the coefficient {coefficient}: only whole numbers are written out")
    size = abs(coefficient.numerator)
    factors = [] if size == 1 else ["(" + " + ".join(["one"] * size) + ")"]
    factors += [spelled(name) for name in scalars]
    factors += [f"tr {spelled(x.name)}" if x.flipped else spelled(x.name) for x in word]
    product = " * ".join(factors) or "one"
    return f"opp ({product})" if coefficient < 0 else product


def spelled(name: str) -> str:
    for mark, plain in SPELLED.items():
        name = name.replace(mark, plain)
    return "x_" + "".join(c if c.isascii() and (c.isalnum() or c == "_") else f"u{ord(c):x}" for c in name)
