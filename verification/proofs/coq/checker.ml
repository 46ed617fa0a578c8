(* Reads impacts as `iapb certify --export` writes them and lets the extracted [check] judge each: `yes`, no gain, or `no`.
   Not proved: this reading of a text file into lists of integers, OCaml, and Coq's extraction. *)
open Judge

let rec positive n = if n = 1 then XH else if n land 1 = 0 then XO (positive (n lsr 1)) else XI (positive (n lsr 1))
let integer n = if n = 0 then Z0 else if n > 0 then Zpos (positive n) else Zneg (positive (-n))
let rec natural n = if n = 0 then O else S (natural (n - 1))

exception Malformed of string

(* Decimal digits after at most one minus sign. OCaml reads 0x and 0u literals modulo 2^63, so a large one turns negative. *)
let number word =
  let digits = if String.starts_with ~prefix:"-" word then String.sub word 1 (String.length word - 1) else word in
  let decimal = digits <> "" && String.for_all (fun c -> '0' <= c && c <= '9') digits in
  match if decimal then int_of_string_opt word else None with
  | Some n when n <> min_int -> n
  | _ -> raise (Malformed ("no whole number of at most 62 bits: " ^ word))

(* The first n dyadic numbers of the words, and the words after them. *)
let rec dyadics n words =
  match n, words with
  | 0, rest -> [], rest
  | _, m :: e :: rest ->
      let first = { mantissa = integer (number m); exponent = integer (number e) } in
      let others, rest = dyadics (n - 1) rest in
      first :: others, rest
  | _ -> raise (Malformed "too few numbers")

let rec matrix n d words =
  if n = 0 then [], words
  else
    let row, rest = dyadics d words in
    let rows, rest = matrix (n - 1) d rest in
    row :: rows, rest

let judged line =
  match List.filter (fun word -> word <> "") (String.split_on_char ' ' line) with
  | [] -> raise (Malformed "an empty line")
  | size :: words ->
      let d = number size in
      if d < 1 then raise (Malformed "a size below 1");
      let mass, words = matrix d d words in
      let before, words = dyadics d words in
      let after, words = dyadics d words in
      if words <> [] then raise (Malformed "too many numbers");
      check (natural d) mass before after

let () =
  let file = open_in_bin Sys.argv.(1) in
  let impacts = ref 0 and gains = ref 0 and line = ref 0 in
  let next () = incr line; input_line file in
  let rec judge_lines text =
    if not (String.starts_with ~prefix:"end" text) then begin
      let holds = judged text in
      incr impacts;
      if not holds then incr gains;
      print_endline (if holds then "yes" else "no");
      judge_lines (next ())
    end
    else if text <> Printf.sprintf "end %d" !impacts then
      raise (Malformed (Printf.sprintf "%S, but %d impacts stand before it" text !impacts))
  in
  try
    if next () <> "iapb impacts 2" then raise (Malformed "the first line is not: iapb impacts 2");
    judge_lines (next ());
    (match next () with _ -> raise (Malformed "a line after the end") | exception End_of_file -> ());
    Printf.printf "%d impacts: %d gained energy\n" !impacts !gains;
    exit (if !gains = 0 then 0 else 1)
  with
  | Malformed reason -> Printf.eprintf "line %d: %s\n" !line reason; exit 2
  | End_of_file -> Printf.eprintf "line %d: the file is cut: \"end\" and the number of impacts are missing\n" !line; exit 2
